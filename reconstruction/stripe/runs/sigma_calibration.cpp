#include "reconstruction/stripe/runs/sigma_calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr int kLag = 4;         ///< columns after which speckle is another
constexpr int kBlock = 10;      ///< columns whose mean shows the correlation
constexpr double kTails = 0.7;  ///< how far the largest fifth of squares is believed; more takes corners for errors

/// What four values at those columns count in their third divided difference.
std::array<double, 4> shares_of_difference(const std::array<double, 4>& columns) {
  std::array<double, 4> shares;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    shares[k] = 1;
    for (std::size_t other = 0; other < shares.size(); ++other)
      if (other != k) shares[k] /= columns[k] - columns[other];
  }
  return shares;
}

/// Third divided differences of points `lag` apart, over their sigmas: squared. A smooth curve has next to none.
void third_differences(const std::vector<double>& column, const std::vector<double>& value,
                       const std::vector<double>& variance, std::size_t lag, std::vector<double>& squares) {
  std::array<double, 4> columns{}, shares{};
  for (std::size_t i = 0; i + 3 * lag < value.size(); ++i) {
    std::array<double, 4> from_first;  // mostly those of the point before
    for (std::size_t k = 0; k < 4; ++k) from_first[k] = column[i + k * lag] - column[i];
    if (from_first != columns) shares = shares_of_difference(columns = from_first);
    double difference = 0, expected = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      difference += shares[k] * value[i + k * lag];
      expected += shares[k] * shares[k] * variance[i + k * lag];
    }
    squares.push_back(difference * difference / expected);
  }
}

/// Mean square by the median, as of normal values, or by the largest fifth where `tails` of that is more. `expected`
/// beforehand with the weight of `prior` values.
double mean_square(std::vector<double>& squares, double expected, double prior, double tails) {
  constexpr double kMedianOfChiSquare = 0.4549, kFourFifthsOfChiSquare = 1.6424;
  if (squares.empty()) return expected;
  const auto n = static_cast<double>(squares.size());
  const double median = upper_median(squares) / kMedianOfChiSquare;
  const auto fifth = squares.begin() + std::ssize(squares) * 4 / 5;
  std::nth_element(squares.begin(), fifth, squares.end());
  const double measured = std::max(median, tails * *fifth / kFourFifthsOfChiSquare);
  return (prior * expected + n * measured) / (prior + n);
}

}  // namespace

std::vector<double> calibrate_sigmas(std::vector<FittedRun>& runs) {
  constexpr double kImagePrior = 12, kRunPrior = 30, kBlockPrior = 6;  // in points and blocks
  std::vector<double> all_single, all_blocked, column, value, variance;
  std::vector<std::vector<double>> single(runs.size()), blocked(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    column.clear(), value.clear(), variance.clear();
    for (const RunPoint& point : runs[r]) {
      column.push_back(point.peak.column);
      value.push_back(point.peak.position);
      variance.push_back(static_cast<double>(point.peak.sigma_px) * point.peak.sigma_px);
    }
    third_differences(column, value, variance, kLag, single[r]);
    all_single.insert(all_single.end(), single[r].begin(), single[r].end());
    std::vector<double> block_column, block_value, block_variance;
    for (std::size_t i = 0; i + kBlock <= value.size(); i += kBlock) {
      double c = 0, v = 0, s = 0;
      for (std::size_t k = i; k < i + kBlock; ++k) c += column[k] / kBlock, v += value[k] / kBlock, s += variance[k];
      block_column.push_back(c), block_value.push_back(v), block_variance.push_back(s / (kBlock * kBlock));
    }
    third_differences(block_column, block_value, block_variance, 1, blocked[r]);
    all_blocked.insert(all_blocked.end(), blocked[r].begin(), blocked[r].end());
  }
  const double image = mean_square(all_single, 1, kImagePrior, kTails);
  const double image_correlation = mean_square(all_blocked, image, kImagePrior, kTails) / image;
  std::vector<double> correlations;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double run = std::clamp(mean_square(single[r], image, kRunPrior, kTails), 0.04, 100.0);
    for (RunPoint& point : runs[r]) point.peak.sigma_px *= static_cast<float>(std::sqrt(run));
    const double of_blocks = mean_square(blocked[r], run * image_correlation, kBlockPrior, 0);
    correlations.push_back(std::clamp(of_blocks / run, 1.0, 0.8 * kBlock));
  }
  return correlations;
}

}  // namespace tankrig
