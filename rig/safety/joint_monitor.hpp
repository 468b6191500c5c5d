// Watches joints and their set-points against limits of angle, velocity, current and distance from the plan.
#pragma once

#include <optional>
#include <string>

#include "drivers/arm/arm.hpp"
#include "rig/safety/joint_limits.hpp"

namespace tankrig {

/// Which limit was crossed, where, and by how much. Assigning one allocates nothing.
struct JointViolation {
  enum class Limit : std::uint8_t {
    kAngle,           ///< measured, beyond its limit [rad]
    kRefusal,         ///< measured this near to a limit, and driven on towards it [rad]
    kVelocity,        ///< measured [rad/s]
    kTicks,           ///< measured [ticks/s]
    kSetPointStep,    ///< asked for [rad/s]
    kCurrent,         ///< of the whole arm, for too long [A]
    kFollowingError,  ///< [rad]
  };
  Limit kind = Limit::kAngle;
  int joint = 0;     ///< means nothing for the current
  double value = 0;  ///< found
  double limit = 0;  ///< expected at most, or at least for a lower angle
};

/// "elbow at 2.2010 rad, limit 2.1529".
std::string describe(const JointViolation& violation);

/// | limit           | is crossed when                                                                           |
/// |-----------------|-------------------------------------------------------------------------------------------|
/// | angle           | a measured angle is more than `beyond` outside its limits                                 |
/// | refusal         | a set-point drives a joint on that is nearer to its limit than `refusal_margin`, and also |
/// |                 | more than `beyond` outside of where the plan goes: what was planned and checked may go to |
/// |                 | the limit itself, to park there                                                           |
/// | velocity, ticks | a joint's mean over `velocity_window` is faster                                           |
/// | set-point step  | a joint's set-point differs by more from the one before it                                |
/// | current         | the arm takes more than `amperes` at every reading for `duration`                         |
/// | following error | a joint is farther from where the plan wanted it when it was measured                     |
///
/// Endless joints have no limit of angle. An arm without known angles (not homed) is not watched here: its driver
/// refuses it. The caller latches the answer.
/// Threads: one.
/// RT: safe.
class JointMonitor {
 public:
  using Answer = std::optional<JointViolation>;

  /// `following_error` [rad].
  JointMonitor(const JointLimits& limits, double following_error);

  /// The least and largest angle of every joint in the plan followed from now on.
  void set_reach(const std::array<JointLimit, kJoints>& reach) noexcept;

  /// Checks a new state.
  Answer check_state(const JointState& state) noexcept;
  /// Checks set-points before they are sent.
  Answer check_set_point(const JointVector& velocity, const JointState& newest) noexcept;
  /// `planned`: where the plan wanted the joints when `measured` was.
  Answer check_following(const JointVector& planned, const JointVector& measured) const noexcept;

 private:
  static constexpr int kPast = 16;

  Answer check_angles(const JointVector& q) const noexcept;
  Answer check_speeds(const JointState& state) noexcept;
  const JointState* window_ago(Stamp now) const noexcept;

  const JointLimits limits_;
  const double following_error_;
  std::array<JointLimit, kJoints> refused_;  // set-points are, outside of these
  std::array<JointState, kPast> past_{};     // a part of the window apart
  std::int64_t count_ = 0;
  JointVector set_point_ = JointVector::Zero();
  OverCurrentWatch current_;
};

}  // namespace tankrig
