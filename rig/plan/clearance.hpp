// How near the arm's bodies come to what stands around them and to each other, pair by pair.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "rig/plan/obstacles.hpp"

namespace tankrig {

enum class PairKind { kObject, kTank, kCamera, kFrame, kArm };
inline constexpr std::array<const char*, 5> kPairKindNames{"object", "floor and walls", "cameras", "frame",
                                                           "arm itself"};

/// The arm is a chain of capsules: slew link, upper arm, elbow and forearm along the DH links, and what it carries.
/// Each is paired with every obstacle, with the arm's base and with each other, except for what always touches: bodies
/// that share a joint, base and upper arm, and the upper arm with what of the forearm is within kElbowRadii link radii of
/// the elbow.
/// Distances are FCL's between triangles: a capsule's axis is one of no width, a box has twelve. Its solver for solids,
/// GJK, is not used: some of its distances are too large (FCL issue 508).
/// Frames: b.
/// Threads: one at a time.
class Clearance {
 public:
  static constexpr double kElbowRadii = 4;

  Clearance(const ArmModel& arm, const Obstacles& obstacles);
  ~Clearance();

  std::size_t pairs() const noexcept;
  PairKind kind(std::size_t pair) const;
  std::string name(std::size_t pair) const;  ///< "camera mono: forearm"

  /// From skin to skin; where bodies overlap, not below minus the sum of their radii [m].
  double at(std::size_t pair, const JointVector& q) const;
  /// Bound of how fast at() changes, whatever the posture [m/s]. `velocity` [rad/s].
  double closing_speed(std::size_t pair, const JointVector& velocity) const;

 private:
  struct Model;
  std::unique_ptr<Model> model_;
};

}  // namespace tankrig
