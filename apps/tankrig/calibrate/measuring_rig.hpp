// A rig file as the error budget sees it: what measures, how it sweeps, and the places on its object.
#pragma once

#include <vector>

#include "calibration/budget/error_budget.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

MeasuringRig measuring_rig(const RigConfig& rig);
BudgetSweep sweep_of(const RigConfig& rig);

/// 500 samples of the object's mesh.
/// Frames: b.
/// Errors: InputError of the mesh.
std::vector<BudgetTarget> budget_targets(const RigObject& object);

/// What the sigmas of its calibration cost a rig; without one, what those of its drawings cost.
Budget budget_of(const RigConfig& rig);
/// What the values of `drawn` would cost where those of `rig` are right.
Budget budget_of_drawings(const RigConfig& rig, const RigConfig& drawn);

}  // namespace tankrig::app
