#include "rig/safety/guarded_outputs.hpp"

#include <utility>

#include "rig/safety/emergency.hpp"

namespace tankrig {

InterlockLimits interlock_limits(const SafetySettings& s) noexcept {
  return {from_seconds(s.indicator_delay), from_seconds(s.maximum_on), from_seconds(s.hold_limit)};
}

GuardedOutputs::~GuardedOutputs() {
  [[maybe_unused]] const Status dark = laser_off();
  [[maybe_unused]] const Status rest = arm_stop();
}

const InterlockOutputs& GuardedOutputs::step(InterlockInputs in) noexcept {
  laser_took_ = arm_took_ = false;
  in.device_fault = in.device_fault || emergency_declared();
  const InterlockStep next = tankrig::step(state_, in, limits_);
  state_ = next.state;
  allowed_ = next.outputs;
  return allowed_;
}

Status GuardedOutputs::switch_laser() noexcept {
  const bool on = std::exchange(allowed_.laser, false);
  if (!on && laser_on_) return laser_off();
  const Status done = on && !laser_on_ ? laser_.on(right_) : Status{};
  laser_took_ = done.ok();
  if (done.ok()) laser_on_ = on;
  return done;
}

Status GuardedOutputs::laser_off() noexcept {
  allowed_.laser = false;
  const Status done = laser_.off();
  laser_took_ = done.ok();
  if (done.ok()) laser_on_ = false;
  return done;
}

Result<JointVector> GuardedOutputs::move(const JointVector& velocity) noexcept {
  const bool rest = (velocity.array() == 0).all();
  if (std::exchange(allowed_.motion, false) || rest) {
    const auto done = arm_.write_velocity(right_, velocity);
    arm_took_ = done.ok();
    return done;
  }
  arm_took_ = false;
  [[maybe_unused]] const Status stopped = arm_.stop();
  return Error{ErrorCode::kRefused, 0, {}, "arm: motion that the safety step does not allow"};
}

Status GuardedOutputs::home(const TickSpeeds& ticks_per_s) noexcept {
  allowed_.motion = false;
  if (std::exchange(allowed_.homing, false) || ticks_per_s == TickSpeeds{}) {
    const Status done = arm_.write_ticks(right_, ticks_per_s);
    arm_took_ = done.ok();
    return done;
  }
  arm_took_ = false;
  [[maybe_unused]] const Status stopped = arm_.stop();
  return Error{ErrorCode::kRefused, 0, {}, "arm: homing that the safety step does not allow"};
}

bool GuardedOutputs::complete() noexcept {
  if (!laser_took_ || !arm_took_) return false;
  if (watch_) watch_->completed(right_);
  if (box_) box_->completed(right_);
  return true;
}

}  // namespace tankrig
