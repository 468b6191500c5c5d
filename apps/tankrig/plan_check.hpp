// What a plan means on its rig, before anything moves: is it safe, and how much will be recorded.
#pragma once

#include "rig/config/rig_config.hpp"
#include "rig/plan/motion_check.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// The plan against limits, box, floor and walls of the rig file.  Errors: InputError if it is not safe.
MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan);

/// How many frames a camera will record, at the times or the angles it is set to.
int expected_frames(const RigConfig& rig, const RigCamera& camera, const ScanPlan& plan);

}  // namespace tankrig::app
