#include "reconstruction/stripe/stripe_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/median.hpp"
#include "reconstruction/stripe/run_line.hpp"

namespace tankrig {
namespace {

constexpr int kLag = 4;            ///< columns after which speckle is another
constexpr int kBlock = 10;         ///< columns whose mean shows the correlation
constexpr int kMaxGap = 3;         ///< missing columns over which a line is drawn
constexpr double kBendPrice = 20;  ///< chi-square, of two degrees of freedom, above which two lines are better than one
constexpr double kTolerance = 3.0;

/// Deviation of the middle of three from the line of the others, over its sigma: squared.
void second_differences(const std::vector<double>& column, const std::vector<double>& value,
                        const std::vector<double>& variance, std::size_t lag, std::vector<double>& squares) {
  for (std::size_t i = lag; i + lag < value.size(); ++i) {
    const double span = column[i + lag] - column[i - lag];
    const double w = (column[i] - column[i - lag]) / span;
    const double d = value[i] - (1 - w) * value[i - lag] - w * value[i + lag];
    squares.push_back(d * d / (variance[i] + (1 - w) * (1 - w) * variance[i - lag] + w * w * variance[i + lag]));
  }
}

/// Mean square by the median, as of normal values; `expected` beforehand with the weight of `prior` values.
double mean_square(std::vector<double>& squares, double expected, double prior) {
  constexpr double kMedianOfChiSquare = 0.4549;
  const auto n = static_cast<double>(squares.size());
  return squares.empty() ? expected : (prior * expected + n * upper_median(squares) / kMedianOfChiSquare) / (prior + n);
}

/// Points before which the run bends, steps or has a gap.
std::vector<std::size_t> breaks_of(const FittedRun& run, int reach, double correlation) {
  const std::size_t n = run.size();
  std::vector<double> evidence(n, 0.0);
  for (std::size_t i = 1; i < n; ++i) {
    const double column = 0.5 * (run[i - 1].peak.column + run[i].peak.column);
    if (run[i].peak.column - run[i - 1].peak.column > kMaxGap + 1) {
      evidence[i] = HUGE_VAL;
      continue;
    }
    for (const int side : {reach, reach / 2}) {
      if (side < 4) continue;
      std::size_t first = i, last = i;
      while (first > 0 && column - run[first - 1].peak.column < side) --first;
      while (last < n && run[last].peak.column - column < side) ++last;
      if (i - first < 4 || last - i < 4) continue;
      const auto at = [&](std::size_t k) { return run.begin() + static_cast<std::ptrdiff_t>(k); };
      const RunLine left = fit_line<false>(at(first), at(i), column), right = fit_line<false>(at(i), at(last), column);
      if (!left.ok || !right.ok) continue;
      const double a = left.variance + right.variance, b = left.covariance + right.covariance,
                   c = left.slope_variance + right.slope_variance;
      const double dv = left.value - right.value, ds = left.slope - right.slope, determinant = a * c - b * b;
      if (!(determinant > 0)) continue;
      const double chi2 = (c * dv * dv - 2 * b * dv * ds + a * ds * ds) / determinant / correlation;
      evidence[i] = std::max(evidence[i], chi2);
    }
  }
  std::vector<std::size_t> breaks;
  const auto near = static_cast<std::size_t>(std::max(2, reach / 3));
  for (std::size_t i = 1; i < n; ++i) {
    if (evidence[i] < kBendPrice) continue;
    const std::size_t from = i > near ? i - near : 0, to = std::min(n - 1, i + near);
    bool highest = true;
    for (std::size_t k = from; k <= to; ++k)
      highest = highest && (evidence[k] < evidence[i] || (evidence[k] == evidence[i] && k >= i));
    if (highest) breaks.push_back(i);
  }
  return breaks;
}

/// Sigmas follow what the points near by scatter about their lines: a square's edge or a grain of the surface is not
/// everywhere.
void scale_locally(const std::vector<double>& residuals, FittedRun& run) {
  constexpr int kReach = 15;
  constexpr double kPrior = 8, kMost = 25;
  for (std::size_t i = 0; i < run.size(); ++i) {
    double sum = kPrior, weight = kPrior;
    for (std::size_t k = i - std::min<std::size_t>(i, kReach); k < std::min(run.size(), i + kReach + 1); ++k) {
      if (std::isnan(residuals[k]) || std::abs(run[k].peak.column - run[i].peak.column) > kReach) continue;
      sum += std::min(residuals[k], kMost);
      weight += 1;
    }
    run[i].peak.sigma_px *= static_cast<float>(std::sqrt(sum / weight));
  }
}

/// Mean of squares over what sigma lets expect; no gross one counts for more than a few.
double capped_mean(const std::vector<double>& squares) {
  constexpr double kPrior = 4, kMost = 100;
  double sum = kPrior, weight = kPrior;
  for (const double square : squares)
    if (!std::isnan(square)) sum += std::min(square, kMost), weight += 1;
  return sum / weight;
}

/// Squared distances of some points of [begin, end) from the parabola through 40 columns, over what sigma lets expect:
/// what a line of few columns follows is an error all the same where neighbours share it.
void add_long_residuals(const FittedRun& run, std::size_t begin, std::size_t end, double correlation,
                        std::vector<double>& residuals) {
  constexpr int kReach = 20;
  constexpr double kLeastLeft = 0.5;  // of the variance, beside a parabola
  constexpr std::size_t kStep = 5, kLeast = 24;
  std::size_t first = begin, last = begin;
  for (std::size_t i = begin; i < end; i += kStep) {
    const double column = run[i].peak.column, own = std::pow(run[i].peak.sigma_px, 2);
    while (first < i && column - run[first].peak.column > kReach) ++first;
    while (last < end && run[last].peak.column - column <= kReach) ++last;
    if (last - first < kLeast) continue;
    const RunLine line = fit_line(run.begin() + static_cast<std::ptrdiff_t>(first),
                                  run.begin() + static_cast<std::ptrdiff_t>(last), column);
    if (!line.ok) continue;
    const double value = line.value + line.bend_at * line.bend;
    const double variance = correlation * (line.variance + line.bend_at * line.bend_at * line.bend_variance);
    residuals.push_back(std::pow(run[i].peak.position - value, 2) / std::max(own - variance, kLeastLeft * own));
  }
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
    second_differences(column, value, variance, kLag, single[r]);
    all_single.insert(all_single.end(), single[r].begin(), single[r].end());
    std::vector<double> block_column, block_value, block_variance;
    for (std::size_t i = 0; i + kBlock <= value.size(); i += kBlock) {
      double c = 0, v = 0, s = 0;
      for (std::size_t k = i; k < i + kBlock; ++k) c += column[k] / kBlock, v += value[k] / kBlock, s += variance[k];
      block_column.push_back(c), block_value.push_back(v), block_variance.push_back(s / (kBlock * kBlock));
    }
    second_differences(block_column, block_value, block_variance, 1, blocked[r]);
    all_blocked.insert(all_blocked.end(), blocked[r].begin(), blocked[r].end());
  }
  const double image = mean_square(all_single, 1, kImagePrior);
  const double image_correlation = mean_square(all_blocked, image, kImagePrior) / image;
  std::vector<double> correlations;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double run = std::clamp(mean_square(single[r], image, kRunPrior), 0.25, 100.0);
    for (RunPoint& point : runs[r]) point.peak.sigma_px *= static_cast<float>(std::sqrt(run));
    const double of_blocks = mean_square(blocked[r], run * image_correlation, kBlockPrior);
    correlations.push_back(std::clamp(of_blocks / run, 1.0, 0.8 * kBlock));
  }
  return correlations;
}

void smooth_run(FittedRun& run, int half_window, double correlation) {
  constexpr int kUsual = 10;  // half window of the lines that sigma is measured by where nothing is smoothed
  const FittedRun raw = run;
  const int widest = half_window > 0 ? half_window : kUsual;
  const std::vector<std::size_t> breaks = breaks_of(raw, widest, correlation);
  std::vector<double> residuals(raw.size(), NAN);  // squared, over what sigma lets expect
  std::vector<double> long_residuals;
  std::size_t begin = 0;
  for (const std::size_t end : breaks) {
    add_long_residuals(raw, begin, end, correlation, long_residuals);
    begin = end;
  }
  add_long_residuals(raw, begin, raw.size(), correlation, long_residuals);
  begin = 0;
  auto next_break = breaks.begin();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    while (next_break != breaks.end() && *next_break <= i) begin = *next_break++;
    const std::size_t end = next_break == breaks.end() ? raw.size() : *next_break;
    const double column = raw[i].peak.column, own = std::pow(raw[i].peak.sigma_px, 2);
    for (int reach = widest; reach >= 1; reach /= 2) {
      std::size_t first = i, last = i + 1;
      while (first > begin && column - raw[first - 1].peak.column <= reach) --first;
      while (last < end && raw[last].peak.column - column <= reach) ++last;
      if (last - first < 3) continue;
      const RunLine line = fit_line(raw.begin() + static_cast<std::ptrdiff_t>(first),
                                    raw.begin() + static_cast<std::ptrdiff_t>(last), column);
      if (!line.ok) continue;
      const double freedom = line.points - 2;
      const double of_bend = line.bend_variance > 0 ? line.bend * line.bend / line.bend_variance : 0;
      if (line.chi2 - of_bend > freedom + kTolerance * std::sqrt(2 * freedom * correlation)) continue;
      // As much of the parabola as the points speak for: its own variance is more than a straight line's.
      const double noise = line.bend_variance * correlation;
      const double part = noise > 0 ? std::max(0.0, 1 - 2 * noise / (line.bend * line.bend)) : 0;
      const double value = line.value + part * line.bend_at * line.bend;
      const double uncorrelated = line.variance + part * line.bend_at * line.bend_at * line.bend_variance;
      const double variance = correlation * uncorrelated;
      if (variance > own) continue;
      residuals[i] = std::pow(raw[i].peak.position - value, 2) / std::max(own - uncorrelated, 0.1 * own);
      if (half_window > 0) {
        run[i].peak.position = static_cast<float>(value);
        run[i].peak.sigma_px = static_cast<float>(std::sqrt(variance));
      }
      break;
    }
  }
  const auto shared =
      static_cast<float>(std::sqrt(std::max(1.0, capped_mean(long_residuals) / capped_mean(residuals))));
  for (RunPoint& point : run) point.peak.sigma_px *= shared;
  scale_locally(residuals, run);
}

}  // namespace tankrig
