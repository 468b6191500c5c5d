// The arm's bodies: capsules along its links, intersected in closed form, so that it moves without rebuilding.
#pragma once

#include <optional>
#include <vector>

#include "sim_backends/world/radiometry.hpp"

namespace tankrig::sim {

/// All points within `radius` of the segment from a to b; w [m].
struct Capsule {
  Vector3f a = Vector3f::Zero(), b = Vector3f::Zero();
  float radius = 0;
  Rgb albedo{0.5f, 0.5f, 0.5f};
  bool projector = false;  ///< the laser's own housing, which does not block its light
};

struct BodyHit {
  float distance = 0;
  Vector3f normal = Vector3f::UnitZ();
  int part = -1;
};

/// Base, links, actuators, gripper and laser housing at the joints `q`.
std::vector<Capsule> arm_bodies(const ArmSpec& arm, const LaserLine& laser, const JointVector& q);

/// Nearest capsule beyond `from` and before `to` along the ray.
std::optional<BodyHit> intersect(const std::vector<Capsule>& bodies, const Vector3f& origin,
                                 const Vector3f& unit_direction, float from, float to);

}  // namespace tankrig::sim
