// Where an obstacle and a body of the arm are nearest to each other.
#pragma once

#include <string>

#include "rig/plan/clearance.hpp"

namespace tankrig {

/// On the surfaces of both.
/// Frames: b.
struct NearestPoints {
  Vector3d obstacle = Vector3d::Zero(), body = Vector3d::Zero();
};

/// Of the pair with this name, as Clearance::name() has it. Where bodies overlap, the points say only about where.
/// Errors: InputError if there is no such pair.
NearestPoints nearest_points(const ArmModel& arm, const Obstacles& obstacles, const std::string& pair,
                             const JointVector& q);

}  // namespace tankrig
