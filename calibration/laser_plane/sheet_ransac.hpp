// The plane that most points lie on, by PCL's sample consensus.
#pragma once

#include <optional>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// RANSAC as the paper uses it: fixed seed, so that the same points give the same plane. Nothing if no three points span a
/// plane.
std::optional<Plane> ransac_plane(const std::vector<Vector3d>& points, double inlier_distance);

}  // namespace tankrig
