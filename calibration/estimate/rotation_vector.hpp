// Rotations as vectors: how small changes of one carry over.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/frames.hpp"

namespace tankrig {

/// cross(a) * b = a x b.
inline Eigen::Matrix3d cross(const Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// How exp(r) turns with r: exp(r + d) = exp(J d) exp(r).
inline Eigen::Matrix3d left_jacobian(const Vector3d& r) {
  const double angle = r.norm();
  if (angle < 1e-8) return Eigen::Matrix3d::Identity() + 0.5 * cross(r);
  const Eigen::Matrix3d k = cross(r / angle);
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / angle * k + (1 - std::sin(angle) / angle) * k * k;
}

}  // namespace tankrig
