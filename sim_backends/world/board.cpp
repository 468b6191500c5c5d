// Places of a board that is shown.
#include "sim_backends/world/board.hpp"

#include <cmath>
#include <numbers>

#include "sim_backends/world/hash_noise.hpp"
#include "sim_backends/world/render_geometry.hpp"
#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {
namespace {

/// Is the board's print, sampled on a grid, in front of all that stands in the tank?
bool free_view(const Transform& wMt, const BoardPrint& print, const Vector3d& eye, const RenderGeometry& geometry) {
  constexpr int kSteps = 6;
  for (int j = 0; j <= kSteps; ++j)
    for (int i = 0; i <= kSteps; ++i) {
      const Vector2d at = print.from() + print.size().cwiseProduct(Vector2d(i, j) / kSteps);
      const Vector3d way = wMt * Vector3d(at.x(), at.y(), 0) - eye;
      const auto distance = static_cast<float>(way.norm());
      if (geometry.occluded(eye.cast<float>(), way.normalized().cast<float>(), 0.01f, distance + 0.01f)) return false;
    }
  return true;
}

}  // namespace

std::vector<Transform> places_of(const BoardShow& show, const BoardPrint& print, const CameraSpec& camera,
                                 const RenderGeometry& geometry) {
  constexpr double kEdge = 0.14;  // of the image, that the board's middle keeps away from
  const auto sequence = [](int k, double step) { return std::fmod(0.5 + k * step, 1.0); };
  const Vector2d middle = print.from() + 0.5 * print.size();
  std::vector<Transform> places;
  for (int k = 0; k < show.count; ++k) {
    const auto random = [&](int n) { return unit(mix(mix(show.seed, hash_text(show.camera)), 16 * k + n)); };
    const double u = kEdge + (1 - 2 * kEdge) * sequence(k, 0.7548776662466927),
                 v = kEdge + (1 - 2 * kEdge) * sequence(k, 0.5698402909980532);
    const Vector3d ray = camera.model.ray(u * (camera.model.width - 1), v * (camera.model.height - 1));
    const double towards = 2 * std::numbers::pi * random(0), tilt = show.tilt * std::sqrt(random(1));
    const double roll = 0.6 * (random(2) - 0.5);
    Transform cMt = Transform::Identity();
    cMt.linear() = (Eigen::AngleAxisd(tilt, Vector3d(std::cos(towards), std::sin(towards), 0)) *
                    Eigen::AngleAxisd(roll, Vector3d::UnitZ()))
                       .toRotationMatrix();
    double distance = show.nearest + (show.farthest - show.nearest) * sequence(k, std::numbers::phi);
    do {
      cMt.translation() = distance * ray - cMt.linear() * Vector3d(middle.x(), middle.y(), 0);
      distance *= 0.95;
    } while (distance > 0.1 && !free_view(camera.wMc * cMt, print, camera.wMc.translation(), geometry));
    places.push_back(camera.wMc * cMt);
  }
  return places;
}

}  // namespace tankrig::sim
