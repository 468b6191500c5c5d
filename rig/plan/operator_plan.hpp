// What an operator asks for outside of a scan: a move in the dark, and light with the arm at rest.
#pragma once

#include <string>

#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// now -> to, straight in joint space, at the settings' move velocity, acceleration and jerk, then `settle` to come to
/// rest in. No light, no frames.
/// Errors: InputError naming a setting that is not positive.
ScanPlan make_move_plan(const ScanSettings& settings, const JointVector& now, const JointVector& to,
                        const std::string& name);

/// The arm stays at `now`: dark block, laser on, warm-up, then `lit_s` seconds whose frames are recorded as a sweep's,
/// laser off.
/// Errors: InputError naming a setting that is not positive.
ScanPlan make_lit_hold_plan(const ScanSettings& settings, const JointVector& now, double lit_s);

}  // namespace tankrig
