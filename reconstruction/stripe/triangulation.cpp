#include "reconstruction/stripe/triangulation.hpp"

#include <cmath>

namespace tankrig {
namespace {

constexpr double kPixelStep = 0.25;  ///< for the change of range with the stripe's position

ViewingRay ray_at(const CameraModel& camera, bool rows, double along, double across) {
  return rows ? camera.sight(across, along) : camera.sight(along, across);
}

}  // namespace

void triangulate(const StripeDetection& detection, const CameraModel& camera, const Plane& cPl, int frame,
                 const TriangulationParameters& parameters, std::vector<CloudPoint>& points,
                 StripeStatistics& statistics) {
  const bool rows = detection.orientation == StripeOrientation::kRows;
  const double min_sine = std::sin(parameters.min_angle);
  for (const StripePeak& peak : detection.peaks) {
    const ViewingRay ray = ray_at(camera, rows, peak.column, peak.position);
    const double sine = cPl.normal.dot(ray.direction);
    if (!(std::abs(sine) >= min_sine) || sine == 0) {
      ++statistics.grazing;
      continue;
    }
    const double range = -cPl.distance(ray.origin) / sine;
    if (!(range > 0) || !(ray.at(range).z() > 0)) {
      ++statistics.behind_camera;
      continue;
    }
    CloudPoint point;
    point.p = ray.at(range);
    point.intensity = peak.intensity;
    point.frame = frame;
    point.column = peak.column;
    if (peak.sigma_px > 0 || parameters.plane_angle_sigma > 0) {
      const ViewingRay beside = ray_at(camera, rows, peak.column, peak.position + kPixelStep);
      const double range_per_px =
          (-cPl.distance(beside.origin) / cPl.normal.dot(beside.direction) - range) / kPixelStep;
      const double lever = (point.p + cPl.offset * cPl.normal).norm();
      point.sigma = static_cast<float>(
          std::hypot(range_per_px * peak.sigma_px, lever * parameters.plane_angle_sigma / std::abs(sine)));
    }
    points.push_back(point);
    ++statistics.points;
  }
}

}  // namespace tankrig
