// How far the laser's plane places the stripe off boards that stand where other cameras' or other pictures' corners say.
#pragma once

#include <optional>
#include <vector>

#include "calibration/laser_plane/stripe_points.hpp"

namespace tankrig {

/// Points of a stripe that are judged by their mean: squares' edges pull single ones.
inline constexpr std::size_t kStretch = 32;

/// Where the laser's plane has the stripe along the lines of sight: the mean distance of its stretches from the board [m]. A
/// rest of fewer than kStretch points is not judged.
/// Frames: c; cMt is the board's, which is z = 0 of t, and distances are along its z. `points`: of one frame, on the board, where the camera
/// sees them.
std::vector<double> stretches_off(const CameraModel& camera, const Plane& cPl, const Transform& cMt,
                                  const std::vector<PlacedStripePoint>& points);

/// Root mean square [m]; nothing of none. Up to 5 % that lie 10 mm off or more are left out: what was found there is no stripe of the
/// sheet.
std::optional<double> rms_of_stretches(const std::vector<double>& off);

}  // namespace tankrig
