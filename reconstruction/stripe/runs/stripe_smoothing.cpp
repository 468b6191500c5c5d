#include "reconstruction/stripe/runs/stripe_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>

#include "reconstruction/stripe/runs/run_breaks.hpp"
#include "reconstruction/stripe/runs/run_series.hpp"
#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr double kTolerance = 4.5;  ///< of the chi-square, in its sd

TANKRIG_VECTORISED
void fit_lines_around(const RunSeries& s, std::size_t i, std::size_t reach, RunLine<FourDoubles>& lines) {
  lines = line_through(s, i - reach, i + reach + 1, load<FourDoubles>(s.column.data() + i));
}

/// Of one point or four that follow each other.
template <class Real>
inline __attribute__((always_inline)) void add_scatter_of(const double* column, const double* residual, double reach,
                                                          double most, double* sum, double* weight, int offset) {
  const Real size = load<Real>(residual + offset), apart = load<Real>(column + offset) - load<Real>(column), none = {};
  const Mask<Real> counts = (size >= 0) & (apart <= reach) & (apart >= -reach);
  const Real sums = load<Real>(sum) + (counts ? (size < most ? size : none + most) : none),
             weights = load<Real>(weight) + (counts ? none + 1 : none);
  std::memcpy(sum, &sums, sizeof sums);
  std::memcpy(weight, &weights, sizeof weights);
}

/// Adds what a point's neighbours scatter about their lines, as far as it was measured, within `reach` columns.
TANKRIG_VECTORISED
void add_scatter(const double* column, const double* residual, int count, double reach, double most, double* sums,
                 double* weights, int offset) {
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    add_scatter_of<FourDoubles>(column + i, residual + i, reach, most, sums + i, weights + i, offset);
  for (; i < count; ++i) add_scatter_of<double>(column + i, residual + i, reach, most, sums + i, weights + i, offset);
}

/// Sigmas follow what the points near by scatter about their lines: a square's edge or a grain of the surface is not
/// everywhere.
void scale_locally(const RunSeries& s, const std::vector<double>& residuals, FittedRun& run) {
  constexpr int kReach = 15;
  constexpr double kPrior = 8, kMost = 25;
  const int n = static_cast<int>(run.size());
  std::vector<double> sums(run.size(), kPrior), weights(run.size(), kPrior);
  const int most = std::min(kReach, n - 1);
  for (int offset = -most; offset <= most; ++offset) {
    const int first = std::max(0, -offset), count = n - std::abs(offset);
    add_scatter(s.column.data() + first, residuals.data() + first, count, kReach, kMost, sums.data() + first,
                weights.data() + first, offset);
  }
  for (std::size_t i = 0; i < run.size(); ++i)
    run[i].peak.sigma_px *= static_cast<float>(std::sqrt(sums[i] / weights[i]));
}

/// What a line says of a point in the middle of those it goes through.
struct Smoothed {
  double value, variance;
  double residual;  ///< the point's own distance from it, squared, over what sigma lets expect
};

/// How much neighbouring lines bend [px per column^2].
struct SharedBend {
  double bend = 0, variance = 0;
};

/// Whether the points are on a line or a parabola.
bool agrees(const RunLine<double>& line, double correlation) {
  const double freedom = line.points - 2;
  const double of_bend = line.bend_variance > 0 ? line.bend * line.bend / line.bend_variance : 0;
  return line.ok && line.chi2 - of_bend <= freedom + kTolerance * std::sqrt(2 * freedom * correlation);
}

/// As much of a measured value as speaks for itself, and what that leaves: squared, without noise.
struct Share {
  double part = 0, withheld = 0;

  Share(double value, double noise) {
    if (noise > 0 && value * value > 2 * noise) part = 1 - 2 * noise / (value * value);
    withheld = std::pow(1 - part, 2) * std::max(0.0, value * value - noise);
  }
};

/// None where the points say no more than the point itself. A line's own bend is mostly noise, its neighbours' together
/// are not: it counts as far as it differs from theirs, and theirs as far as they differ from none.
std::optional<Smoothed> smoothed_by(const RunLine<double>& line, const SharedBend& shared, double position, double own,
                                    double correlation) {
  const double own_variance = line.bend_variance - shared.variance;
  const Share theirs(shared.bend, shared.variance * correlation),
      more(line.bend - shared.bend, own_variance * correlation);
  const double value = line.value + line.bend_at * (theirs.part * shared.bend + more.part * (line.bend - shared.bend));
  const double uncorrelated =
      line.variance + line.bend_at * line.bend_at * (theirs.part * shared.variance + more.part * own_variance);
  if (correlation * uncorrelated > own) return std::nullopt;
  const double withheld = line.bend_at * line.bend_at * (theirs.withheld + more.withheld);
  return Smoothed{value, std::min(own, correlation * uncorrelated + withheld),
                  std::pow(position - value, 2) / std::max(own - uncorrelated, 0.1 * own)};
}

/// Through the points of [begin, end) up to `reach` columns to both sides of point `i`.
RunLine<double> line_around(const RunSeries& s, std::size_t i, std::size_t begin, std::size_t end, int reach) {
  std::size_t first = i, last = i + 1;
  while (first > begin && s.column[i] - s.column[first - 1] <= reach) --first;
  while (last < end && s.column[last] - s.column[i] <= reach) ++last;
  return last - first < 3 ? RunLine<double>{} : line_through(s, first, last, s.column[i]);
}

/// By the widest line up to `reach` columns to both sides of point `i` that its points of [begin, end) agree with.
std::optional<Smoothed> smoothed(const RunSeries& s, std::size_t i, std::size_t begin, std::size_t end, int reach,
                                 double correlation) {
  for (; reach >= 1; reach /= 2) {
    const RunLine<double> line = line_around(s, i, begin, end, reach);
    if (!agrees(line, correlation)) continue;
    if (const auto found = smoothed_by(line, {}, s.position[i], 1 / s.weight[i], correlation)) return found;
  }
  return std::nullopt;
}

/// Of each line and `reach` lines on either side of it; none where there are not so many.
std::vector<SharedBend> shared_bends(const std::vector<RunLine<double>>& lines, std::size_t reach) {
  constexpr double kOfOne = 0.2;      // variance of the mean: of errors that are their points' own 0.05
  constexpr double kMostOfOwn = 0.5;  // where few lines agree with their points, the others say little
  const std::size_t window = 2 * reach + 1;
  std::vector<SharedBend> shared(lines.size());
  std::vector<double> weights(lines.size()), weighted(lines.size());  // of those that do not agree 0
  double bends = 0, weight = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].ok && lines[i].bend_variance > 0) {
      weights[i] = 1 / lines[i].bend_variance;
      weighted[i] = weights[i] * lines[i].bend;
    }
    weight += weights[i];
    bends += weighted[i];
    if (i + 1 < window) continue;
    const std::size_t first = i + 1 - window;
    const double mean_of = weight > 0 ? 1 / weight : 0, variance = kOfOne * static_cast<double>(window) * mean_of;
    if (variance < kMostOfOwn * lines[i - reach].bend_variance) shared[i - reach] = {bends * mean_of, variance};
    weight -= weights[first];
    bends -= weighted[first];
  }
  return shared;
}

/// Of all points of [begin, end), into `out`. Four at a time where no column is missing around them.
void smooth_piece(const RunSeries& s, std::size_t begin, std::size_t end, int widest, double correlation,
                  std::vector<std::optional<Smoothed>>& out) {
  const auto reach = static_cast<std::size_t>(widest);
  std::vector<RunLine<double>> lines;
  lines.reserve(end - begin);
  for (std::size_t i = begin; i < end; i = begin + lines.size()) {
    if (i < begin + reach || i + kLanes + reach > end ||
        !s.whole(static_cast<std::ptrdiff_t>(i - reach), static_cast<std::ptrdiff_t>(i + kLanes + reach))) {
      lines.push_back(line_around(s, i, begin, end, widest));
      continue;
    }
    RunLine<FourDoubles> four;
    fit_lines_around(s, i, reach, four);
    for (int k = 0; k < kLanes; ++k) lines.push_back(lane_of(four, k));
  }
  for (RunLine<double>& line : lines) line.ok = agrees(line, correlation);
  const std::vector<SharedBend> shared = shared_bends(lines, reach);
  for (std::size_t i = begin; i < end; ++i) {
    const RunLine<double>& line = lines[i - begin];
    if (line.ok) out[i] = smoothed_by(line, shared[i - begin], s.position[i], 1 / s.weight[i], correlation);
    if (!out[i]) out[i] = smoothed(s, i, begin, end, widest / 2, correlation);
  }
}

/// Of some points of a run, squared distances from the parabola through 56 columns over what sigma lets expect: what a
/// line of few columns follows is an error all the same where neighbours share it.
struct LongResiduals {
  std::vector<double> single, smoothed;  ///< of the points as they are, and as lines have smoothed them
};

void add_long_residuals(const RunSeries& s, std::size_t begin, std::size_t end, double correlation,
                        const std::vector<std::optional<Smoothed>>& smooth, LongResiduals& residuals) {
  constexpr int kReach = 28;
  constexpr double kLeastLeft = 0.5;  // of the variance, beside a parabola
  constexpr std::size_t kStep = 5, kLeast = 24;
  std::size_t first = begin, last = begin;
  for (std::size_t i = begin; i < end; i += kStep) {
    const double column = s.column[i], own = 1 / s.weight[i];
    while (first < i && column - s.column[first] > kReach) ++first;
    while (last < end && s.column[last] - column <= kReach) ++last;
    if (last - first < kLeast) continue;
    const RunLine line = line_through(s, first, last, column);
    if (!line.ok) continue;
    const double value = line.value + line.bend_at * line.bend;
    const double variance = correlation * (line.variance + line.bend_at * line.bend_at * line.bend_variance);
    residuals.single.push_back(std::pow(s.position[i] - value, 2) / std::max(own - variance, kLeastLeft * own));
    if (smooth[i] && variance < (1 - kLeastLeft) * smooth[i]->variance)
      residuals.smoothed.push_back(std::pow(smooth[i]->value - value, 2) / (smooth[i]->variance - variance));
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

}  // namespace

void smooth_run(FittedRun& run, int half_window, double correlation) {
  constexpr int kUsual = 10;  // half window of the lines that sigma is measured by where nothing is smoothed
  const RunSeries raw(run);
  const int widest = half_window > 0 ? half_window : kUsual;
  std::vector<std::size_t> ends = find_breaks(raw, widest, correlation);
  ends.push_back(raw.size());
  std::vector<std::optional<Smoothed>> smooth(raw.size());
  LongResiduals long_residuals;
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    smooth_piece(raw, begin, end, widest, correlation, smooth);
    add_long_residuals(raw, begin, end, correlation, smooth, long_residuals);
    begin = end;
  }
  std::vector<double> residuals(raw.size(), NAN);
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (!smooth[i]) continue;
    residuals[i] = smooth[i]->residual;
    if (half_window == 0) continue;
    run[i].peak.position = static_cast<float>(smooth[i]->value);
    run[i].peak.sigma_px = static_cast<float>(std::sqrt(smooth[i]->variance));
  }
  double shared = std::max(1.0, capped_mean(long_residuals.single) / capped_mean(residuals));
  if (half_window > 0) shared = std::max(shared, capped_mean(long_residuals.smoothed));
  for (RunPoint& point : run) point.peak.sigma_px *= static_cast<float>(std::sqrt(shared));
  scale_locally(raw, residuals, run);
  for (RunPoint& point : run) point.peak.sigma_px = std::max(point.peak.sigma_px, static_cast<float>(point.edge_px));
}

}  // namespace tankrig
