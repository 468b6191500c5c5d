// A rig in motion as whoever listens to the feed sees it: what stands where, the arm's links, the laser.
#pragma once

#include "rig/config/rig_config.hpp"
#include "rig/executive/safe_end.hpp"
#include "rig/scan/scan.hpp"

namespace tankrig::app {

/// Once: the object's mesh and the cameras, in b. A mesh that cannot be read is not shown; whoever scores by it says so.
void show_scene(const RigConfig& rig);
/// The arm, the laser and the plan's time.
void show_state(const RigConfig& rig, const ScanProgress& progress);
/// What was confirmed at the end.
void show_end(const EndState& left);

}  // namespace tankrig::app
