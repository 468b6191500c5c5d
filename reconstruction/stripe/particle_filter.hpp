// Points that no other part of the cloud confirms.
#pragma once

#include <vector>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// Which points to keep: those with a neighbour from another frame within `radius` [m], or with at least `run`
/// neighbours from their own frame within twice that.
std::vector<bool> confirmed_points(const std::vector<CloudPoint>& points, double radius, int run);

}  // namespace tankrig
