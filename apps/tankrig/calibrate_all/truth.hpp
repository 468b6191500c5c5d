// A calibrated rig against the simulated tank it is of: what nobody knows of a real one.
#pragma once

#include "calibration/budget/error_budget.hpp"
#include "rig/config/rig_config.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// The object where somebody has it.
struct ObjectComparison {
  Misplacement places;  ///< against it, as a scan is scored
  double off = 0;       ///< how far its surface is from where it truly is, root mean square [m]
};

struct TruthComparison {
  Misplacement on_true_object;  ///< places against the object where it truly stands, seen from the mono camera
  ObjectComparison calibrated;  ///< where the rig has it: from snapped clicks
  ObjectComparison clicked;     ///< from the clicks as they are
};

TruthComparison compare_with_truth(const RigConfig& rig, const Transform& bMo_clicked, const sim::TankWorld& tank);

}  // namespace tankrig::app
