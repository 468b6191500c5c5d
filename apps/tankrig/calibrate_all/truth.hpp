// A calibrated rig against the simulated tank it is of: what nobody knows of a real one.
#pragma once

#include "calibration/budget/error_budget.hpp"
#include "rig/config/rig_config.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

struct TruthComparison {
  Misplacement on_true_object;       ///< places against the object where it truly stands, seen from the mono camera
  Misplacement on_estimated_object;  ///< against the object where the rig has it, as a scan is scored
  double object = 0;                 ///< how far the rig has the object's surface off, root mean square [m]
};

TruthComparison compare_with_truth(const RigConfig& rig, const sim::TankWorld& tank);

}  // namespace tankrig::app
