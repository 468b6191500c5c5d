// What must be known of arm and laser before a plan is made, and before it starts.
#pragma once

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/plan/scan_settings.hpp"

namespace tankrig {

inline constexpr char kInterlockOpen[] = "laser interlock: found open, expected closed";

/// Reads joints until the arm has reported its posture: a plan starts there.
/// Errors: InputError after `timeout`, or with a driver's failure other than silence.
JointVector read_posture(Arm& arm, Clock& clock, Duration timeout);

/// Waits until the watchdog box has opened for want of edges, as it must before the first step. One that does not would not
/// open when they stop either. At once where the rig gives no edges or reads no enable input.
/// Errors: InputError with the cure, after a second.
void check_box_open(const SafetySettings& settings, const WatchdogBox& box, Clock& clock);

/// run_scan's checks before anything moves.
/// Errors: InputError if the laser warms up longer than the plan waits, or its interlock is open.
void check_laser_ready(const ScanSettings& settings, const Laser& laser, bool interlock_closed);

}  // namespace tankrig
