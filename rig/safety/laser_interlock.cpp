#include "rig/safety/laser_interlock.hpp"

namespace tankrig {

InterlockStep step(const InterlockState& state, const InterlockInputs& in) noexcept {
  const bool arm_edge = in.arm && !state.last_arm;
  const bool reset_edge = in.reset && !state.last_reset;
  const bool good = in.interlock_closed && in.heartbeat_fresh && !in.device_fault;

  InterlockStep next;
  next.state.last_arm = in.arm;
  next.state.last_reset = in.reset;
  if (state.latched) {
    next.state.latched = !(reset_edge && good);
  } else if (in.device_fault || (state.armed && !good)) {
    next.state.latched = true;
  } else if (state.armed) {
    next.state.armed = in.arm;
  } else {
    next.state.armed = arm_edge && good;
  }
  next.outputs.laser = next.state.armed && in.sweeping && in.laser_request;
  next.outputs.motion = !next.state.latched;
  next.outputs.tripped = next.state.latched && !state.latched;
  return next;
}

}  // namespace tankrig
