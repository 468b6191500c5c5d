// What a program needs to draw a planned scan in 3D: the rig, and arm, sheet and clearance along the path.
#pragma once

#include <nlohmann/json.hpp>

#include "rig/config/rig_config.hpp"
#include "rig/plan/motion_check.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// Frames: b. Units: metres. Poses are evenly spread over the plan's time.
nlohmann::ordered_json plan_drawing(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check);

}  // namespace tankrig::app
