// Where the joints of a recording stood at any instant, and how fast they moved.
#pragma once

#include <vector>

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig {

/// The joints at one instant of their own clock.
struct TimedJoints {
  Stamp stamp{};
  JointVector q = JointVector::Zero();
};

inline constexpr double kMotionReach = 0.1;  ///< of readings wanted before and after the instant [s]

struct JointMotion {
  JointVector q = JointVector::Zero(), velocity = JointVector::Zero();  ///< [rad, rad/s]
};
/// Readings come in whole ticks: a parabola through those of the time around `when` errs by a part of one. Where they are few, the
/// line between the two around it. `joints`: two at least, in order of time.
JointMotion motion_at(const std::vector<TimedJoints>& joints, Stamp when);

}  // namespace tankrig
