// What a time error means on the target: how fast the laser plane passes the object.
#pragma once

#include "core/arm_model.hpp"

namespace tankrig {

/// The object as the laser meets it.
/// Frames: plane in e, point in b.
struct SyncTarget {
  ArmModel arm;
  Plane ePl;
  Vector3d object_b = Vector3d::Zero();  ///< its origin [m]
};

/// Speed of the laser plane at the object, along the plane's normal, while the joints move with `velocity` [m/s].
/// RT: safe.
double speed_on_target(const SyncTarget& target, const JointVector& q, const JointVector& velocity) noexcept;

}  // namespace tankrig
