// Keeps the joints on the plan: planned velocities, corrected by the encoders.
#pragma once

#include "drivers/arm/arm.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// Where the plan wanted each joint when it was measured. `age`: from the state's stamp to `plan_time`.
/// RT: safe.
JointVector planned_when_measured(const ScanPlan& plan, double plan_time, Duration age,
                                  const JointState& measured) noexcept;

/// Velocity set-points for the joints that move in the plan's segment; rest for the others.
///
///   set-point = planned velocity (feed_forward_lead ahead) * (1 + correction) + position_gain * (planned - measured)
///
/// * The feed-forward carries the motion. It is sent early by the lag of carrier and actuators.
/// * The position error compares plan and encoder at the instant of the reading, so a known latency costs no error. It
///   also makes up for rounding: whole ticks/s, demands the wire cannot express.
/// * The correction learns how much faster or slower than asked an actuator is: one number per joint, kept between
///   motions. A proportional controller alone would trail by gain error * velocity / position_gain. It learns slowly,
///   and only at constant planned velocity, where an error is neither lag nor dead zone. So the learning does not show
///   in the velocity.
/// * A joint never moves against its segment's direction, so backlash taken up by the lead-in stays so. A set-point is
///   rest, or at least the dead zone's end.
///
/// Threads: one.
/// RT: safe.
class JointFollower {
 public:
  explicit JointFollower(const ScanSettings& settings) : settings_(settings) {}

  /// [rad/s]. `newest`: the last state read, `age` before `plan_time`.
  JointVector step(const ScanPlan& plan, double plan_time, Duration age, const JointState& newest) noexcept;

  /// Learned relative speed correction of every joint.
  const JointVector& correction() const noexcept { return correction_; }

 private:
  void learn(int joint, double error, const Segment& segment, double plan_time, double dt) noexcept;

  const ScanSettings& settings_;
  JointVector correction_ = JointVector::Zero();
  Stamp learned_{};  // stamp of the newest state learned from
};

}  // namespace tankrig
