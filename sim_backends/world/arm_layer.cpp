// Finds the arm's bodies in the image, and shades them.
#include "sim_backends/world/arm_layer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tankrig::sim {
namespace {

constexpr int kSpheres = 32;  ///< that cover a capsule

}  // namespace

ArmLayer::ArmLayer(const std::vector<Capsule>& bodies, const CameraView& view) : view_(&view) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Eigen::Array2f low = Eigen::Array2f::Constant(kInfinity), high = -low;
  for (int u = 0; u <= view.width(); ++u)
    for (const int v : {0, view.height()})
      low = low.min(view.corner(u, v).array()), high = high.max(view.corner(u, v).array());
  for (int v = 0; v <= view.height(); ++v)
    for (const int u : {0, view.width()})
      low = low.min(view.corner(u, v).array()), high = high.max(view.corner(u, v).array());

  const Eigen::Isometry3f cMw = view.spec().wMc.inverse().cast<float>();
  for (const Capsule& body : bodies) {
    Window window{kInfinity, kInfinity, -kInfinity, -kInfinity};
    const Vector3f from = cMw * body.a, along = cMw * body.b - from;
    const float radius = body.radius + 0.5f * along.norm() / kSpheres;
    for (int i = 0; i <= kSpheres; ++i) {
      const Vector3f p = from + along * (static_cast<float>(i) / kSpheres);
      const auto beyond = [&](float side, float slope) { return side > radius * std::sqrt(1 + slope * slope); };
      if (p.z() < -radius || beyond(p.x() - high.x() * p.z(), high.x()) || beyond(low.x() * p.z() - p.x(), low.x()) ||
          beyond(p.y() - high.y() * p.z(), high.y()) || beyond(low.y() * p.z() - p.y(), low.y()))
        continue;
      if (p.z() < 1.5f * radius || view.spec().model.port) {  // behind a port a window has no simple shape
        window = {-kInfinity, -kInfinity, kInfinity, kInfinity};
        break;
      }
      const float x = p.x() / p.z(), y = p.y() / p.z();
      const float margin = 1.2f * radius / (p.z() - radius) * (1 + x * x + y * y);
      window.left = std::min(window.left, x - margin), window.right = std::max(window.right, x + margin);
      window.top = std::min(window.top, y - margin), window.bottom = std::max(window.bottom, y + margin);
    }
    if (window.left > window.right) continue;
    bodies_.push_back(body);
    windows_.push_back(window);
  }
}

void ArmLayer::cover(int first, int count, float* rows, const Radiometry& radiometry, float light,
                     const BoardLayer& boards) const {
  const int width = view_->width(), channels = view_->channels();
  std::vector<Capsule> near;
  for (int v = first; v < first + count; ++v)
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2f& at = view_->corner(u, v);
      near.clear();
      for (std::size_t i = 0; i < windows_.size(); ++i) {
        const Window& w = windows_[i];
        if (at.x() > w.left && at.x() < w.right && at.y() > w.top && at.y() < w.bottom) near.push_back(bodies_[i]);
      }
      if (near.empty()) continue;
      // Two quarters on a diagonal decide for the pixel where they agree, all four where they do not.
      std::optional<BodyHit> seen;
      Vector3f p = Vector3f::Zero();
      const auto covers = [&](float du, float dv) {
        const CameraView::Sight ray = view_->sight(static_cast<float>(u) + du, static_cast<float>(v) + dv);
        const float free = boards.in_view() ? std::min(view_->range(u, v), boards.range(ray)) : view_->range(u, v);
        const auto hit = intersect(near, ray.origin, ray.direction, 0.005f, free);
        if (!hit) return 0;
        if (!seen) seen = hit, p = ray.origin + hit->distance * ray.direction;
        return 1;
      };
      int covered = covers(-0.25f, -0.25f) + covers(0.25f, 0.25f);
      if (covered == 1)
        covered += covers(0.25f, -0.25f) + covers(-0.25f, 0.25f);
      else
        covered *= 2;
      if (!seen) continue;
      const Rgb e = radiometry.direct(p, seen->normal) + radiometry.open_water(p) * (0.65f + 0.35f * seen->normal.z());
      const Rgb exitance =
          near[seen->part].albedo * e * radiometry.transmission(seen->distance) + radiometry.veil(seen->distance);
      const auto value = view_->response(exitance * (light * view_->scale()));
      const float share = 0.25f * static_cast<float>(covered);
      float* out = rows + (static_cast<std::size_t>(v - first) * width + u) * channels;
      for (int c = 0; c < channels; ++c) out[c] += share * (value[c] - out[c]);
    }
}

}  // namespace tankrig::sim
