#include "rig/safety/laser_interlock.hpp"

namespace tankrig {
namespace {

/// A stretch of light, as of this step: dark for the indicator's delay ends it.
bool in_stretch(const InterlockState& state, const InterlockInputs& in, const InterlockLimits& limits) noexcept {
  return state.stretch && in.now - state.last_lit < limits.indicator_delay;
}

bool over_long(const InterlockState& state, const InterlockInputs& in, const InterlockLimits& limits) noexcept {
  return in_stretch(state, in, limits) && in.now - state.lit_at > limits.maximum_on;
}

/// Of a state that is not latched; the order is that of the truth table.
Trip trip_of(const InterlockState& state, const InterlockInputs& in, const InterlockLimits& limits) noexcept {
  if (in.slept) return Trip::kSlept;
  if (in.device_fault) return Trip::kDevice;
  if (in.beam != BeamVerdict::kNone) return Trip::kBeam;
  if (!in.enabled && (state.last_enabled || state.armed || in.homing)) return Trip::kDisabled;
  if (!state.armed && !in.homing) return Trip::kNone;
  if (!in.heartbeat_fresh) return Trip::kHeartbeat;
  if (!in.interlock_closed) return Trip::kInterlock;
  if (!state.armed) return Trip::kNone;
  const bool asks = in.laser_request && (in.sweeping || state.holding);
  if (asks && over_long(state, in, limits)) return Trip::kMaximumOn;
  if (state.holding && !in.at_rest) return Trip::kMotion;
  return Trip::kNone;
}

}  // namespace

InterlockStep step(const InterlockState& state, const InterlockInputs& in, const InterlockLimits& limits) noexcept {
  const bool arm_edge = in.arm && !state.last_arm;
  const bool hold_edge = in.hold && !state.last_hold;
  const bool lines = in.interlock_closed && in.heartbeat_fresh && in.enabled;

  InterlockStep next;
  InterlockState& s = next.state;
  s = state;
  s.last_arm = in.arm;
  s.last_hold = in.hold;
  s.last_enabled = in.enabled;
  s.armed = s.holding = false;
  if (state.latched) {
    s.latched = true;
  } else if (const Trip trip = trip_of(state, in, limits); trip != Trip::kNone) {
    s.latched = true;
    next.outputs.trip = trip;
  } else if (state.armed) {
    s.armed = in.arm;
    const bool goes_on = state.holding && in.hold && in.now - state.held_at < limits.hold;
    const bool begins = !state.holding && hold_edge && in.at_rest;
    s.holding = in.arm && !in.sweeping && (goes_on || begins);
    if (s.holding && begins) s.held_at = in.now;
  } else if (arm_edge && lines) {
    s.armed = true;
    s.armed_at = in.now;
  }

  next.outputs.laser = s.armed && in.laser_request && (in.sweeping || s.holding) &&
                       in.now - s.armed_at >= limits.indicator_delay && !over_long(state, in, limits);
  next.outputs.motion = !s.latched && !s.holding && in.enabled;
  next.outputs.homing = next.outputs.motion && in.homing && !s.armed && lines;
  s.stretch = in_stretch(state, in, limits) || next.outputs.laser;
  if (next.outputs.laser) {
    s.last_lit = in.now;
    if (!in_stretch(state, in, limits)) s.lit_at = in.now;
  }
  return next;
}

}  // namespace tankrig
