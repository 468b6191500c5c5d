// Limits of a running arm's joints: the rig file's `scan: limits:`.
#pragma once

#include <array>

#include "core/arm_model.hpp"
#include "drivers/arm/over_current.hpp"

namespace tankrig {

/// Source of the defaults: the laboratory's public controller and the public robot description (docs/reference/motion.md).
/// Units: SI, radians.
struct JointLimits {
  std::array<JointLimit, kJoints> angles = arm5e().limits;  ///< the rig's arm.limits_rad
  double beyond = 0.03;          ///< how far beyond an angle's limit a joint may stand: backlash, a soft stop
  double refusal_margin = 0.05;  ///< nearer to a limit, a set-point towards it is refused unless the plan goes there
  double velocity = 1.0;         ///< measured, any joint
  double ticks_per_s = 2200;     ///< measured, any actuator: a tenth above what it is ever asked for
  Duration velocity_window = std::chrono::milliseconds(100);  ///< measured over so long
  double set_point_step = 0.4;  ///< largest change from one velocity set-point to the next; 0: any
  OverCurrentLimit current;
};

}  // namespace tankrig
