// Where two viewing rays meet.
#pragma once

#include "core/flat_port.hpp"

namespace tankrig {

/// The middle of the shortest way between two rays, from `a` along `u` and from `b` along `v`, of any lengths. They are not
/// parallel.
Vector3d meeting(const Vector3d& a, const Vector3d& u, const Vector3d& b, const Vector3d& v);

inline Vector3d meeting(const ViewingRay& a, const ViewingRay& b) {
  return meeting(a.origin, a.direction, b.origin, b.direction);
}

}  // namespace tankrig
