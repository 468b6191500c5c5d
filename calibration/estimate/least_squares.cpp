#include "calibration/estimate/least_squares.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "core/input_error.hpp"

namespace tankrig {

ceres::Solver::Options solver_options(ceres::LinearSolverType linear) {
  ceres::Solver::Options options;
  options.linear_solver_type = linear;
  options.num_threads = 1;  // more change the order of sums
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 200;
  options.max_num_consecutive_invalid_steps =
      200;  // towards points behind the camera; after five Ceres complains on the terminal
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-12;
  return options;
}

void minimise(ceres::Problem& problem, const std::string& what) {
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(ceres::DENSE_QR), &problem, &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost))
    throw InputError(fmt::format("{}: found no minimum ({})", what, summary.message));
}

Linearised linearised(ceres::Problem& problem, const std::vector<double*>& parameters) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = parameters;
  options.apply_loss_function = false;
  options.num_threads = 1;
  std::vector<double> residuals;
  ceres::CRSMatrix rows;
  problem.Evaluate(options, nullptr, &residuals, nullptr, &rows);
  Linearised out;
  out.residuals = Eigen::Map<const Eigen::VectorXd>(residuals.data(), static_cast<Eigen::Index>(residuals.size()));
  out.jacobian = Eigen::MatrixXd::Zero(rows.num_rows, rows.num_cols);
  for (int row = 0; row < rows.num_rows; ++row)
    for (int k = rows.rows[row]; k < rows.rows[row + 1]; ++k) out.jacobian(row, rows.cols[k]) = rows.values[k];
  return out;
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& jacobian, const std::vector<std::string>& names,
                              const std::string& what) {
  // Scaled to unit columns: radians and metres alike.
  const Eigen::VectorXd length = jacobian.colwise().norm();
  for (Eigen::Index k = 0; k < length.size(); ++k)
    if (!(length[k] > 0))
      throw InputError(fmt::format("{}: the data says nothing about {}", what, names[static_cast<std::size_t>(k)]));
  const Eigen::MatrixXd unit = jacobian * length.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.transpose() * unit);
  constexpr double kLeast = 1e-10;
  if (!(eigen.eigenvalues()[0] > kLeast)) {
    Eigen::Index worst = 0;
    eigen.eigenvectors().col(0).cwiseAbs().maxCoeff(&worst);
    throw InputError(fmt::format("{}: the data leaves {} open", what, names[static_cast<std::size_t>(worst)]));
  }
  const Eigen::MatrixXd inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  return length.cwiseInverse().asDiagonal() * inverse * length.cwiseInverse().asDiagonal();
}

double interval_factor(double degrees_of_freedom) {
  if (!(degrees_of_freedom > 0)) return std::numeric_limits<double>::infinity();
  return boost::math::quantile(boost::math::complement(boost::math::students_t(degrees_of_freedom), 0.025));
}

double moved_by(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance) {
  return std::sqrt((jacobian * covariance * jacobian.transpose()).trace());
}

}  // namespace tankrig
