// What solvers share: least squares by Ceres with the same bits every time, covariances, intervals, millimetres on the target.
#pragma once

#include <ceres/problem.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// One estimated number.
struct Estimate {
  std::string name;
  std::string unit;  ///< "rad", "m" or "px", of the next three
  double value = 0;
  double sigma = 0;       ///< one standard deviation
  double half_width = 0;  ///< of the 95 % interval
  double effect = 0;      ///< how far `sigma` moves the target [m]
};

/// Minimises in one thread by a dense QR.
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

/// Student's t: the 95 % interval is +- this many sigmas. Infinite without a degree of freedom.
double interval_factor(double degrees_of_freedom);

/// Root of the summed variances of a point moved by `jacobian` (3 x n) [m].
double moved_by(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance);

}  // namespace tankrig
