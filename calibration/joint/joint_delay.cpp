// How well a fit knows the delay: by the slowest waves of what the stripes are off along the sweep.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/joint/joint_fit.hpp"

namespace tankrig {

DelaySpread delay_spread(const JointFit& fit) {
  const auto& numbers = fit.linear.numbers;
  const auto column = std::find_if(numbers.begin(), numbers.end(), [](const JointColumn& c) { return c.unit == "s"; });
  const Eigen::VectorXd of_delay = fit.normal.covariance.col(column - numbers.begin());
  // The delay is off by the sum of all rows' shares of it.
  const auto share = [&](std::size_t row) {
    double sum = 0;
    for (int i = fit.linear.rows[row]; i < fit.linear.rows[row + 1]; ++i) {
      const auto a = static_cast<std::size_t>(i);
      if (fit.linear.columns[a] < of_delay.size()) sum += fit.linear.values[a] * of_delay[fit.linear.columns[a]];
    }
    return sum;
  };
  constexpr int kWaves = 2;
  double rest = of_delay[column - numbers.begin()], waves = 0, squares = 0;
  std::size_t row = 0;
  for (std::size_t s = 0; s < fit.strays.size(); ++s) {
    struct Part {
      double elbow = 0, weight = 0, off = 0;
    };
    std::vector<Part> parts;
    double total = 0;
    for (std::size_t i = 0; i < fit.strays[s].size(); ++i) {
      if (fit.strays[s][i]) continue;
      while (fit.linear.group[row] != static_cast<int>(fit.at.offset())) ++row;
      Part part{fit.problem.sheets[s].stripes[i].q[kElbow], 0, 0};
      for (const std::size_t last = row + 2; row < last; ++row) {
        const double a = share(row);
        part.weight += a * a, part.off += a * fit.linear.residuals[static_cast<Eigen::Index>(row)];
      }
      total += part.weight;
      parts.push_back(part);
    }
    rest -= total;
    if (!(total > 0)) continue;
    std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.elbow < b.elbow; });
    double before = 0, sums[kWaves] = {};
    for (const Part& part : parts) {
      const double way = (before + 0.5 * part.weight) / total;
      before += part.weight;
      for (int k = 0; k < kWaves; ++k)
        sums[k] += std::numbers::sqrt2 * std::cos(std::numbers::pi * (k + 1) * way) * part.off;
    }
    double variance = 0;
    for (const double sum : sums) variance += sum * sum / kWaves;
    waves += variance, squares += variance * variance / kWaves;
  }
  const double variance = std::max(rest, 0.0) + waves;
  constexpr double kMostFreedom = 1e6;
  return {std::sqrt(std::max(variance, of_delay[column - numbers.begin()])),
          squares > 0 ? std::min(kMostFreedom, variance * variance / squares) : kMostFreedom};
}

}  // namespace tankrig
