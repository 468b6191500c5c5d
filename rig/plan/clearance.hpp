// Distances of the arm's bodies from their surroundings and each other, pair by pair.
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

/// The arm is a chain of capsules: slew link, upper arm, elbow and forearm along the DH links; and what it carries.
/// Each is paired with every obstacle, with the arm's base and with the others. Left out are pairs that always touch:
/// bodies with a common joint, base and upper arm, and the upper arm with the part of the forearm within kElbowRadii
/// link radii of the elbow.
/// FCL gives distances between triangles: a capsule's axis is one without width, a box has twelve. FCL's solver for
/// solids, GJK, is not used, because some of its distances are too large (FCL issue 508).
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

  /// From surface to surface; where bodies overlap, at least minus the sum of their radii [m].
  double at(std::size_t pair, const JointVector& q) const;
  /// Upper bound of the rate of at(), in any posture [m/s]. `velocity` [rad/s].
  double closing_speed(std::size_t pair, const JointVector& velocity) const;

 private:
  struct Model;
  std::unique_ptr<Model> model_;
};

}  // namespace tankrig
