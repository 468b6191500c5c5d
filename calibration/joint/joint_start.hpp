// What the joint problem starts from: the steps' results as numbers, and what its measurements err at first.
#pragma once

#include "calibration/joint/joint_least_squares.hpp"

namespace tankrig {

inline constexpr double kLeast_px = 1e-6;  ///< sigma of exact data, so that it can be weighed

/// Errors: InputError with what is missing.
void check(const JointProblem& problem);

/// In the middle of the stripes as the steps place them; v along their longest extent.
PlaneFrame plane_frame(const JointProblem& problem);

JointState first_state(const JointProblem& problem);

std::vector<ErrorGroup> first_groups(const JointProblem& problem);

}  // namespace tankrig
