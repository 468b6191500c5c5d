// Normals of a cloud's surface, from each point's neighbours.
#pragma once

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// The points that have at least four neighbours within `radius_m`, each with the normal of the plane through them (by
/// PCL), on the side of `seen_from`: the camera that saw the cloud.
/// Frames: `seen_from` in the cloud's.
PointCloud with_normals(const PointCloud& cloud, double radius_m, const Vector3d& seen_from);

/// Holds three lines of the default scan, which are 4 mm apart [m].
inline constexpr double kNormalRadius = 0.012;

}  // namespace tankrig
