// Motions outside of a scan: a move in the dark, postures to take pictures in, and light with the arm at rest.
#pragma once

#include <string>
#include <vector>

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

/// now -> each posture in turn -> now. After each move the arm rests for `settle`, then for `rest_s`; then frames are
/// recorded in a dark block whose pass is the posture's number. No light.
/// Errors: InputError naming a setting that is not positive, or if there is no posture.
ScanPlan make_postures_plan(const ScanSettings& settings, const JointVector& now,
                            const std::vector<JointVector>& postures, double rest_s);

}  // namespace tankrig
