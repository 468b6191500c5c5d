// How much of the surface has a point of the cloud near it.
#pragma once

#include <vector>

#include "bench/metrics/metrics.hpp"

namespace tankrig {

/// One result per threshold [m], in their order. `ceiling` may be null.
std::vector<Coverage> surface_coverage(const std::vector<SurfaceSample>& samples, const std::vector<Vector3d>& points,
                                       const std::vector<double>& thresholds, const Ceiling* ceiling);

}  // namespace tankrig
