#include "rig/executive/cycle_record.hpp"

namespace tankrig {

const char* to_string(ExecutiveState state) noexcept {
  switch (state) {
    case ExecutiveState::kWaiting:
      return "waiting";
    case ExecutiveState::kRunning:
      return "running";
    case ExecutiveState::kDone:
      return "done";
    case ExecutiveState::kStopped:
      return "stopped";
    case ExecutiveState::kFault:
      return "fault";
  }
  return "?";
}

const char* to_string(Fault fault) noexcept {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kArmRead:
      return "arm read failed";
    case Fault::kArmSilent:
      return "arm silent";
    case Fault::kArmWrite:
      return "arm refused a set-point";
    case Fault::kLaser:
      return "laser failed";
    case Fault::kFollowingError:
      return "following error";
    case Fault::kHeartbeat:
      return "heartbeat late";
    case Fault::kInterlock:
      return "interlock open";
    case Fault::kOverrun:
      return "cycle overrun";
    case Fault::kJointLimit:
      return "joint limit";
    case Fault::kJointVelocity:
      return "joint too fast";
    case Fault::kJointCurrent:
      return "over-current";
    case Fault::kMaximumOn:
      return "laser on for too long";
    case Fault::kBeamMissing:
      return "beam not seen";
    case Fault::kBeamStray:
      return "stray beam";
    case Fault::kThread:
      return "thread died";
    case Fault::kMovedInHold:
      return "arm moved though held";
    case Fault::kHoldRefused:
      return "light at rest refused";
    case Fault::kDisabled:
      return "watchdog box not enabled";
    case Fault::kSuspended:
      return "machine suspended";
    case Fault::kGuardian:
      return "not guarded";
  }
  return "?";
}

}  // namespace tankrig
