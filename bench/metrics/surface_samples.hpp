// The object's surface as small patches of known area, each with one random point: what coverage is counted on.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig {

struct SurfaceSample {
  Vector3d p = Vector3d::Zero();
  std::uint32_t triangle = 0;
  float weight = 0;  ///< the patch's share of the whole surface
};

/// Every triangle is halved along its longest edge until no edge is longer than twice the spacing that gives about
/// `count` patches on the whole surface; each patch gives one point, uniform in it. At least one per triangle. The same
/// every time.
std::vector<SurfaceSample> sample_surface(const TriangleMesh& mesh, std::size_t count);

/// One standard deviation of sum(contribution) over stratified samples, estimated from pairs of neighbouring patches
/// (collapsed strata: W. G. Cochran, Sampling Techniques, 5A.12; errs on the large side).
double stratified_sigma(const std::vector<double>& contributions);

}  // namespace tankrig
