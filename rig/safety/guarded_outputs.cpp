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
  in.device_fault = in.device_fault || emergency_declared();
  const InterlockStep next = tankrig::step(state_, in, limits_);
  state_ = next.state;
  allowed_ = next.outputs;
  return allowed_;
}

Status GuardedOutputs::switch_laser() noexcept {
  const bool on = std::exchange(allowed_.laser, false);
  if (!on) return laser_on_ ? laser_off() : Status{};
  if (laser_on_) return {};
  const Status done = laser_.on(right_);
  if (done.ok()) laser_on_ = true;
  return done;
}

Status GuardedOutputs::laser_off() noexcept {
  allowed_.laser = false;
  const Status done = laser_.off();
  if (done.ok()) laser_on_ = false;
  return done;
}

Result<JointVector> GuardedOutputs::move(const JointVector& velocity) noexcept {
  const bool rest = (velocity.array() == 0).all();
  if (std::exchange(allowed_.motion, false) || rest) return arm_.write_velocity(right_, velocity);
  [[maybe_unused]] const Status stopped = arm_.stop();
  return Error{ErrorCode::kRefused, 0, {}, "arm: motion that the safety step does not allow"};
}

Status GuardedOutputs::home(const TickSpeeds& ticks_per_s) noexcept {
  allowed_.motion = false;
  if (std::exchange(allowed_.homing, false) || ticks_per_s == TickSpeeds{})
    return arm_.write_ticks(right_, ticks_per_s);
  [[maybe_unused]] const Status stopped = arm_.stop();
  return Error{ErrorCode::kRefused, 0, {}, "arm: homing that the safety step does not allow"};
}

}  // namespace tankrig
