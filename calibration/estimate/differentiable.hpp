// The rig's models for any scalar, so that Ceres can differentiate them: a moved pose, the arm's chain, a camera.
#pragma once

#include <ceres/rotation.h>

#include <Eigen/Geometry>

#include "core/arm_model.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

template <class T>
using TransformOf = Eigen::Transform<T, 3, Eigen::Isometry>;
template <class T>
using VectorOf = Eigen::Matrix<T, 3, 1>;

/// Six numbers of a small step from a pose aMb: a rotation vector about a's axes, then a translation in a. The origin of b
/// moves by the translation alone.
inline constexpr int kPoseStep = 6;

template <class T>
TransformOf<T> moved(const Transform& aMb, const T* step) {
  Eigen::Matrix<T, 3, 3> turn;
  ceres::AngleAxisToRotationMatrix(step, turn.data());
  TransformOf<T> out = TransformOf<T>::Identity();
  out.linear() = turn * aMb.linear().template cast<T>();
  out.translation() = aMb.translation().template cast<T>() + VectorOf<T>(step[3], step[4], step[5]);
  return out;
}

/// The step that leads from `from` to `to`.
inline Eigen::Matrix<double, kPoseStep, 1> step_between(const Transform& from, const Transform& to) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
  Eigen::Matrix<double, kPoseStep, 1> step;
  step << turn.angle() * turn.axis(), to.translation() - from.translation();
  return step;
}

/// What is added to the numbers of a DH chain: a, alpha, d, theta0 of each link, in the order of ArmModel::dh.
inline constexpr int kDhNumbers = 16;

template <class T>
TransformOf<T> end_effector(const ArmModel& arm, const JointVector& q, const T* added) {
  TransformOf<T> m = TransformOf<T>::Identity();
  for (int i = 0; i < 4; ++i) {
    const DhLink& link = arm.dh[static_cast<std::size_t>(i)];
    const T* more = added + 4 * i;
    m = m * Eigen::AngleAxis<T>(more[3] + q[i] + link.theta0, VectorOf<T>::UnitZ()) *
        Eigen::Translation<T, 3>(more[0] + link.a, T(0), more[2] + link.d) *
        Eigen::AngleAxis<T>(more[1] + link.alpha, VectorOf<T>::UnitX());
  }
  return m;
}

/// False where the point is not in front of the camera, or not beyond its port.
template <class T>
bool project(const CameraModel& camera, const VectorOf<T>& p, T* pixel) {
  VectorOf<T> seen = p;
  if (camera.port && !seen_through<T>(*camera.port, T(camera.port->distance), camera.port->normal.cast<T>(), p, seen))
    return false;
  if (!(seen.z() > T(1e-6))) return false;
  const T x = seen.x() / seen.z(), y = seen.y() / seen.z(), r2 = x * x + y * y;
  const T radial = T(1) + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  pixel[0] = camera.fx * (x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2.0 * x * x)) + camera.cx;
  pixel[1] = camera.fy * (y * radial + camera.p1 * (r2 + 2.0 * y * y) + 2 * camera.p2 * x * y) + camera.cy;
  return true;
}

}  // namespace tankrig
