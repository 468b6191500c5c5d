// What one cycle of the executive saw and did: nothing else leaves the cycle.
#pragma once

#include <optional>

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "rig/safety/joint_monitor.hpp"

namespace tankrig {

enum class ExecutiveState : std::uint8_t {
  kWaiting,  ///< reads and records, arm at rest, laser off
  kRunning,  ///< follows the plan
  kDone,     ///< plan finished, arm at rest, laser off
  kStopped,  ///< asked to stop: laser off, arm stopped
  kFault,    ///< laser off, arm stopped, latched
};
const char* to_string(ExecutiveState state) noexcept;

enum class Fault : std::uint8_t {
  kNone,
  kArmRead,         ///< the arm's driver reports a failure to read
  kArmSilent,       ///< no joint state within feedback_timeout
  kArmWrite,        ///< the arm's driver refuses a set-point
  kLaser,           ///< the laser's driver reports a failure, or its state differs from its command
  kFollowingError,  ///< a joint is farther from its plan than following_error_limit
  kHeartbeat,       ///< the supervising loop gave no heartbeat within heartbeat_timeout
  kInterlock,       ///< the laser's interlock opened while armed
  kOverrun,         ///< too many late cycles within the window of the real-time settings
  kJointLimit,      ///< a joint is beyond its limits
  kJointVelocity,   ///< a joint is faster than it may be
  kJointCurrent,    ///< the arm draws more current than it may, for too long
  kMaximumOn,       ///< the laser was on for longer than it may be at a stretch
  kBeamMissing,     ///< the camera does not see the beam though the laser is on
  kBeamStray,       ///< the camera sees a beam though the laser is off
  kThread,          ///< a thread the scan depends on has died
  kMovedInHold,     ///< the arm moved while it was held for light at rest
  kHoldRefused,     ///< the arm was not at rest when it was to be held for light
  kDisabled,        ///< the watchdog box cut arm and laser off
  kSuspended,       ///< the machine was suspended: nothing was watched meanwhile, and no time-out saw it
  kGuardian,        ///< the guardian has taken over, or does not watch any more
};
const char* to_string(Fault fault) noexcept;

/// Assigning one allocates nothing.
/// Units: rad, rad/s, seconds of plan time.
struct CycleRecord {
  std::uint64_t cycle = 0;
  Stamp stamp{};              ///< the cycle's start
  double plan_time = 0;       ///< < 0 before the plan starts
  std::uint32_t segment = 0;  ///< index into ScanPlan::segments()
  ExecutiveState state = ExecutiveState::kWaiting;
  Fault fault = Fault::kNone;
  Error error{};                              ///< the device's own words, if `fault` comes from a device
  std::optional<JointViolation> violation{};  ///< if `fault` comes from a joint's limit
  double following_error = 0;                 ///< largest over the joints, at the newest joint sample [rad]
  bool armed = false;                         ///< the safety step's
  bool holding = false;                       ///< the safety step's
  bool laser_commanded = false;
  std::optional<LaserState> laser{};  ///< the device's word; empty if it could not be read in this cycle
  bool has_joints = false;            ///< `joints` is new in this cycle
  JointState joints{};
  JointVector planned = JointVector::Zero();  ///< position set-point
  JointVector desired = JointVector::Zero();  ///< velocity asked for
  JointVector applied = JointVector::Zero();  ///< velocity the driver says it applies
  Status laser_off{};                         ///< of this cycle's attempt to make safe, if any
  Status arm_stop{};                          ///< of the same attempt
};

}  // namespace tankrig
