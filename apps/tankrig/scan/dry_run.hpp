// What a scan would do: its path, clearance, duration, disk need, and which faces it sees and lights.
#pragma once

#include "rig/config/rig_config.hpp"
#include "rig/plan/motion_check.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// Prints it, as a table or as JSON; `draw`: the latter with what draws it in 3D.
void print_dry_run(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check, bool json, bool draw);

}  // namespace tankrig::app
