#include "core/frames.hpp"

#include <fmt/core.h>

#include <cmath>
#include <string>

#include "core/input_error.hpp"

namespace tankrig {

Plane operator*(const Transform& aMb, const Plane& plane_b) {
  const Vector3d normal = aMb.linear() * plane_b.normal;
  return {normal, plane_b.offset - normal.dot(aMb.translation())};
}

Transform make_transform(const Vector3d& translation, const Eigen::Vector4d& q) {
  if (!(std::abs(q.norm() - 1.0) <= 1e-3))
    throw InputError(fmt::format("quaternion has norm {:f}, expected 1", q.norm()));
  Transform m = Transform::Identity();
  m.linear() = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized().toRotationMatrix();
  m.translation() = translation;
  return m;
}

Transform make_transform_rpy(const Vector3d& translation, const Vector3d& rpy) {
  Transform m = Transform::Identity();
  m.linear() = (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
                   .toRotationMatrix();
  m.translation() = translation;
  return m;
}

Eigen::Vector4d quaternion_xyzw(const Transform& aMb) {
  Eigen::Quaterniond q(aMb.linear());
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q.coeffs();
}

Transform as_stored(const Transform& aMb) { return make_transform(aMb.translation(), quaternion_xyzw(aMb)); }

}  // namespace tankrig
