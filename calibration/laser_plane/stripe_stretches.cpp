#include "calibration/laser_plane/stripe_stretches.hpp"

#include <cmath>

namespace tankrig {

std::vector<double> stretches_off(const CameraModel& camera, const Plane& cPl, const Transform& cMt,
                                  const std::vector<PlacedStripePoint>& points) {
  const Transform tMc = cMt.inverse();
  std::vector<double> out;
  double off = 0;
  std::size_t count = 0;
  for (const PlacedStripePoint& point : points) {
    const Vector2d pixel = camera.project(point.p).value();  // it was found there
    const Vector3d ray = camera.ray(pixel.x(), pixel.y());
    const Vector3d placed = point.p - cPl.distance(point.p) / cPl.normal.dot(ray) * ray;
    off += (tMc * placed).z();
    if (++count < kStretch) continue;
    out.push_back(off / static_cast<double>(kStretch));
    off = 0, count = 0;
  }
  return out;
}

std::optional<double> rms_of_stretches(const std::vector<double>& off) {
  constexpr double kStray = 0.010, kMostStrays = 0.05;  // [m]; share of all
  double near = 0, strays = 0;
  std::size_t count = 0;
  for (const double distance : off)
    if (std::abs(distance) < kStray)
      near += distance * distance, ++count;
    else
      strays += distance * distance;
  if (static_cast<double>(off.size() - count) > kMostStrays * static_cast<double>(off.size()))
    near += strays, count = off.size();
  if (count == 0) return std::nullopt;
  return std::sqrt(near / static_cast<double>(count));
}

}  // namespace tankrig
