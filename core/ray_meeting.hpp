// Where two viewing rays meet.
#pragma once

#include <Eigen/QR>

#include "core/flat_port.hpp"

namespace tankrig {

/// The middle of the shortest way between two rays, from `a` along `u` and from `b` along `v`, of any lengths. They are not
/// parallel.
inline Vector3d meeting(const Vector3d& a, const Vector3d& u, const Vector3d& b, const Vector3d& v) {
  Eigen::Matrix<double, 3, 2> directions;
  directions << u, -v;
  const Vector2d lengths = directions.colPivHouseholderQr().solve(b - a);
  return 0.5 * (a + lengths[0] * u + b + lengths[1] * v);
}

inline Vector3d meeting(const ViewingRay& a, const ViewingRay& b) {
  return meeting(a.origin, a.direction, b.origin, b.direction);
}

}  // namespace tankrig
