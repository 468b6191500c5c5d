// The normal equations of the joint problem around a solution.
#pragma once

#include "calibration/joint/joint_least_squares.hpp"

namespace tankrig {

struct JointNormal {
  Eigen::MatrixXd covariance;      ///< (J' J)^-1 of JointLinear's numbers
  Eigen::MatrixXd knocks, across;  ///< J' J of the knocks; of the numbers by the knocks
  Eigen::VectorXd gradient, knock_gradient;
};

/// Errors: InputError naming a number that the data leaves open.
JointNormal normal_of(const JointLinear& linear);

}  // namespace tankrig
