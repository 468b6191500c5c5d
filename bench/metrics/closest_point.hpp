// The point of a triangle nearest to a given point, and on which of its features it lies.
#pragma once

#include "core/frames.hpp"

namespace tankrig {

/// Edges and corners by index: edge k runs from corner k to corner k + 1 (mod 3).
enum class TriangleFeature : unsigned char { kFace, kEdge0, kEdge1, kEdge2, kCorner0, kCorner1, kCorner2 };

/// A triangle as its first corner and the two sides that leave it.
struct TriangleSides {
  Vector3d a, ab, ac;
};

struct ClosestPoint {
  Vector3d point = Vector3d::Zero();
  TriangleFeature feature = TriangleFeature::kFace;
};

/// Voronoi regions of the triangle (C. Ericson, Real-Time Collision Detection, 5.1.5), in double precision.
/// A triangle of area 0 is treated as its three edges.
ClosestPoint closest_point(const TriangleSides& triangle, const Vector3d& p);

}  // namespace tankrig
