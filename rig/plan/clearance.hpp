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
/// Each is paired with every obstacle, with the arm's base and with each other, except for what is always together: two
/// that share a joint, the base and the upper arm, and the forearm with the upper arm nearer to the elbow than
/// kElbowRadii.
/// Distances are FCL's between triangles: a capsule's axis is a triangle of no width, a box has twelve. Its GJK between
/// capsule and box is not used: some of its answers are centimetres too large.
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
