// What solvers share: least squares by Ceres with the same bits every time, covariances, intervals, millimetres on the target.
#pragma once

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/estimate/estimate.hpp"

namespace tankrig {

/// How every solver here has Ceres: one thread and nothing said, as far as doubles go.
ceres::Solver::Options solver_options(ceres::LinearSolverType linear);

/// Minimises by a dense QR.
/// Errors: InputError with `what` if no usable solution is found.
void minimise(ceres::Problem& problem, const std::string& what);

/// Residuals and their derivatives by `parameters`, in that order; no loss is applied, constant parts have columns too.
struct Linearised {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
};
Linearised linearised(ceres::Problem& problem, const std::vector<double*>& parameters);

/// (J' J)^-1 of whitened residuals.
/// Errors: InputError naming with `what` the first of `names` that the data leaves open.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& jacobian, const std::vector<std::string>& names,
                              const std::string& what);

/// Root of the summed variances of a point moved by `jacobian` (3 x n) [m].
double moved_by(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance);

}  // namespace tankrig
