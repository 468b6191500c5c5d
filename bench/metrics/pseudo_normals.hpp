// Normals of faces, edges and corners that tell inside from outside wherever the nearest point lies.
#pragma once

#include <array>
#include <vector>

#include "bench/metrics/closest_point.hpp"
#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig {

/// Angle-weighted pseudo-normals of a welded mesh; not of unit length at edges and corners.
/// Source: Baerentzen and Aanaes, Signed distance computation using the angle weighted pseudonormal, 2005.
class PseudoNormals {
 public:
  explicit PseudoNormals(const TriangleMesh& welded);

  const Vector3d& at(std::size_t triangle, TriangleFeature feature) const;

 private:
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Vector3d> face_;
  std::vector<std::array<Vector3d, 3>> edge_;
  std::vector<Vector3d> corner_;
};

}  // namespace tankrig
