// The floor under an object, found in the cloud itself.
#pragma once

#include <optional>
#include <string>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

struct FloorSettings {
  double band_m = 0.005;  ///< half its thickness: how far from the plane a floor point may be
  double max_tilt = 0.2;  ///< between its normal and up [rad]
};

/// Frames: the cloud's.
struct Floor {
  Plane plane;              ///< its normal points up
  std::vector<int> points;  ///< indices
  double rms_m = 0;         ///< of their distances from it
};

/// Up in the frames of core/frames.hpp that stand still with the tank; nothing for cameras and what moves.
std::optional<Vector3d> up_in(const std::string& frame);

/// The lowest plane that lies across `up` and has next to nothing below it: top faces are passed over. By PCL's RANSAC
/// with a fixed seed, refined by least squares. Nothing if there is none, or fewer than 50 points are on it.
std::optional<Floor> find_floor(const PointCloud& cloud, const Vector3d& up, const FloorSettings& settings = {});

}  // namespace tankrig
