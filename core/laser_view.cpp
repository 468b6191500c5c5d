#include "core/laser_view.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/plausible_length.hpp"

namespace tankrig {

std::optional<double> nearest_seen(const CameraModel& camera, const Plane& cPl) {
  // Inverse depth is linear on the plane z = 1, so it is greatest on the image's border.
  constexpr int kSteps = 32;
  constexpr double kTypicalDepth = 1;  // [m] behind a port
  if (cPl.offset == 0) return 0;
  double inverse_depth = 0;
  const auto look = [&](double across, double down) {
    const Vector2d p = camera.normalized(across * camera.width - 0.5, down * camera.height - 0.5, kTypicalDepth);
    inverse_depth = std::max(inverse_depth, -cPl.normal.dot(Vector3d(p.x(), p.y(), 1)) / cPl.offset);
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double along = static_cast<double>(i) / kSteps;
    look(along, 0), look(along, 1), look(0, along), look(1, along);
  }
  if (!(inverse_depth > 0)) return std::nullopt;
  return 1 / inverse_depth;
}

std::string out_of_view(const CameraModel& camera, std::span<const Plane> planes) {
  std::optional<double> nearest;
  double distance = 0;  // of the camera from the plane that is nearest, or from the last that it does not see
  for (const Plane& plane : planes) {
    const std::optional<double> seen = nearest_seen(camera, plane);
    if (seen && plausible_length(*seen)) return {};
    if (nearest && !(seen && *seen < *nearest)) continue;
    nearest = seen;
    distance = plane.offset;
  }
  if (planes.empty()) return {};
  if (!nearest)
    return fmt::format(
        "found d = {:.6g}, a plane that is nowhere in front of the camera in its view; expected the laser's, with its "
        "sign, in metres",
        distance);
  return fmt::format("found d = {:.6g}, a plane that is {:.3g} m away where the camera sees it nearest{}", distance,
                     *nearest, kLooksLikeMillimetres);
}

}  // namespace tankrig
