// Which move of a camera, board or marker would explain what a fit leaves.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calibration/estimate/differentiable.hpp"
#include "calibration/joint/joint_fit.hpp"

namespace tankrig {
namespace {

/// Root of what the sum of squares falls by with this change of the numbers; each group weighed by what is left of it then, for a
/// move that nobody has looked for makes a group's errors look large, and alike from frame to frame.
double sigmas_better(const JointFit& fit, const Eigen::VectorXd& change) {
  Eigen::VectorXd after = fit.linear.residuals;
  for (std::size_t row = 0; row + 1 < fit.linear.rows.size(); ++row)
    for (int i = fit.linear.rows[row]; i < fit.linear.rows[row + 1]; ++i) {
      const auto a = static_cast<std::size_t>(i);
      after[static_cast<Eigen::Index>(row)] += fit.linear.values[a] * change[fit.linear.columns[a]];
    }
  std::vector<double> was(fit.groups.size()), left(fit.groups.size()), count(fit.groups.size());
  for (std::size_t row = 0; row < fit.linear.group.size(); ++row) {
    if (fit.linear.group[row] < 0) continue;
    const auto g = static_cast<std::size_t>(fit.linear.group[row]);
    const double before = fit.linear.residuals[static_cast<Eigen::Index>(row)],
                 now = after[static_cast<Eigen::Index>(row)];
    was[g] += before * before, left[g] += now * now, ++count[g];
  }
  double sum = 0;
  for (std::size_t g = 0; g < fit.groups.size(); ++g) {
    // By how much the variance of a group is less: not told by a few numbers, six of which the move may take up.
    constexpr double kEnough = 30;
    double less = 1;
    if (count[g] >= kEnough && left[g] > 0) {
      const bool of_stripes = g == fit.at.offset() || g == fit.at.slope();
      const double allowance =
          of_stripes ? serial_allowance(fit.rows_of(g, after)) / serial_allowance(fit.rows_of(g, fit.linear.residuals))
                     : 1;
      less = std::min(1.0, left[g] / was[g] * allowance * allowance * count[g] / (count[g] - kPoseStep));
    }
    sum += (was[g] - left[g]) / less;
  }
  return std::sqrt(std::max(0.0, sum));
}

}  // namespace

std::vector<Discrepancy> discrepancies_of(const JointFit& fit) {
  std::vector<Discrepancy> all;
  for (std::size_t k = 0; k < fit.linear.knocks.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(6 * k);
    const Eigen::MatrixXd across = fit.normal.across.middleCols(at, 6);
    const Eigen::Matrix<double, 6, 6> own = fit.normal.knocks.block<6, 6>(at, at),
                                      left = own - across.transpose() * fit.normal.covariance * across;
    const Eigen::Matrix<double, 6, 1> gradient =
        fit.normal.knock_gradient.segment<6>(at) - across.transpose() * fit.normal.covariance * fit.normal.gradient;
    // Freedoms that the other numbers take up tell nothing.
    const Eigen::Matrix<double, 6, 1> scale = own.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(scale.asDiagonal() * left *
                                                                           scale.asDiagonal());
    Eigen::Matrix<double, 6, 1> step = Eigen::Matrix<double, 6, 1>::Zero();
    for (int i = 0; i < 6; ++i) {
      constexpr double kTakenUp = 1e-6;
      if (!(eigen.eigenvalues()[i] > kTakenUp)) continue;
      const Eigen::Matrix<double, 6, 1> along = scale.asDiagonal() * eigen.eigenvectors().col(i);
      const double slope = along.dot(gradient);
      step -= slope / eigen.eigenvalues()[i] * along;
    }
    Eigen::VectorXd change = Eigen::VectorXd::Zero(fit.normal.covariance.rows() + fit.normal.knocks.rows());
    change.head(fit.normal.covariance.rows()) = -fit.normal.covariance * across * step;
    change.segment<6>(fit.normal.covariance.rows() + at) = step;
    Discrepancy& found = all.emplace_back(Discrepancy{fit.linear.knocks[k], sigmas_better(fit, change), {}});
    // Of camera 0 the stripes tell how their plane has moved: not all six freedoms.
    if (k > 0) found.size = {step.tail<3>().norm(), step.head<3>().norm()};
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Discrepancy& a, const Discrepancy& b) { return a.sigmas > b.sigmas; });
  return all;
}

}  // namespace tankrig
