// Operator's motions outside of a scan: a move in the dark, and light with the arm at rest.
#pragma once

#include <string>

#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// now -> to, straight in joint space, at the settings' move velocity, acceleration and jerk, then at rest for
/// `settle`. No light, no frames.
/// Errors: InputError naming a setting that is not positive.
ScanPlan make_move_plan(const ScanSettings& settings, const JointVector& now, const JointVector& to,
                        const std::string& name);

/// now -> to -> now and again, `times` times to and fro, each way as in make_move_plan.
/// Errors: likewise.
ScanPlan make_rocking_plan(const ScanSettings& settings, const JointVector& now, const JointVector& to, int times);

/// The arm stays at `now`: dark block, laser on, warm-up, `lit_s` seconds recorded as a sweep, laser off.
/// Errors: InputError naming a setting that is not positive.
ScanPlan make_lit_hold_plan(const ScanSettings& settings, const JointVector& now, double lit_s);

}  // namespace tankrig
