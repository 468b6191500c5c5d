#include "calibration/joint/joint_normal.hpp"

#include <Eigen/Cholesky>

#include "core/input_error.hpp"

namespace tankrig {

JointNormal normal_of(const JointLinear& linear) {
  const auto n = static_cast<Eigen::Index>(linear.numbers.size());
  const auto all = n + 6 * static_cast<Eigen::Index>(linear.knocks.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(all);
  for (std::size_t row = 0; row + 1 < linear.rows.size(); ++row)
    for (int i = linear.rows[row]; i < linear.rows[row + 1]; ++i) {
      const auto a = static_cast<std::size_t>(i);
      gradient[linear.columns[a]] += linear.values[a] * linear.residuals[static_cast<Eigen::Index>(row)];
      for (int j = linear.rows[row]; j < linear.rows[row + 1]; ++j) {
        const auto b = static_cast<std::size_t>(j);
        information(linear.columns[a], linear.columns[b]) += linear.values[a] * linear.values[b];
      }
    }
  const auto open = [&](Eigen::Index k) {
    throw InputError("joint refinement: the data leaves " + linear.numbers[static_cast<std::size_t>(k)].name + " open");
  };
  const Eigen::VectorXd diagonal = information.diagonal().head(n);
  for (Eigen::Index k = 0; k < n; ++k)
    if (!(diagonal[k] > 0)) open(k);
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(scale.asDiagonal() * information.topLeftCorner(n, n) * scale.asDiagonal());
  constexpr double kLeastPivot = 1e-6;
  Eigen::Index least = 0;
  const double pivot = factor.matrixLLT().diagonal().cwiseAbs().minCoeff(&least);
  if (factor.info() != Eigen::Success || !(pivot > kLeastPivot)) open(least);
  JointNormal out;
  out.covariance = scale.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(n, n)) * scale.asDiagonal();
  out.knocks = information.bottomRightCorner(all - n, all - n);
  out.across = information.topRightCorner(n, all - n);
  out.gradient = gradient.head(n);
  out.knock_gradient = gradient.tail(all - n);
  return out;
}

}  // namespace tankrig
