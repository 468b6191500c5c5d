// What a scan would do: its path, clearance, duration, disk need, and which faces it sees and lights.
#pragma once

#include "rig/config/rig_config.hpp"
#include "rig/plan/motion_check.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// The plan against limits, box, floor and walls of the rig file.  Errors: InputError if it is not safe.
MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan);

/// Prints it, as a table or as JSON.
void print_dry_run(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check, bool json);

/// How many frames a camera will record, at the times or the angles it is set to.
int expected_frames(const RigConfig& rig, const RigCamera& camera, const ScanPlan& plan);

}  // namespace tankrig::app
