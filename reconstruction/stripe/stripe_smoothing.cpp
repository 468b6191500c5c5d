#include "reconstruction/stripe/stripe_smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <optional>

#include "core/median.hpp"
#include "reconstruction/stripe/run_line.hpp"
#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr int kLag = 4;            ///< columns after which speckle is another
constexpr int kBlock = 10;         ///< columns whose mean shows the correlation
constexpr int kMaxGap = 3;         ///< missing columns over which a line is drawn
constexpr double kBendPrice = 22;  ///< chi-square, of two degrees of freedom, above which two lines are better than one
constexpr double kTolerance = 4.5;

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

/// Mean square by the median, as of normal values; `expected` beforehand with the weight of `prior` values.
double mean_square(std::vector<double>& squares, double expected, double prior) {
  constexpr double kMedianOfChiSquare = 0.4549;
  const auto n = static_cast<double>(squares.size());
  return squares.empty() ? expected : (prior * expected + n * upper_median(squares) / kMedianOfChiSquare) / (prior + n);
}

/// A run's points, so that lines through them are quickly fitted.
struct Series {
  std::vector<double> column, position, weight;  ///< the last: 1 / sigma^2

  explicit Series(const FittedRun& run) {
    for (auto* values : {&column, &position, &weight}) values->reserve(run.size());
    for (const auto& [peak, amplitude, colour, edge] : run) {
      column.push_back(peak.column);
      position.push_back(peak.position);
      weight.push_back(1 / (static_cast<double>(peak.sigma_px) * peak.sigma_px));
    }
  }
  std::size_t size() const { return column.size(); }

  /// Whether [first, last) is within the run and no column is missing there.
  bool whole(std::ptrdiff_t first, std::ptrdiff_t last) const {
    return first >= 0 && last <= std::ssize(column) &&
           column[last - 1] - column[first] == static_cast<double>(last - 1 - first);
  }
};

/// Line through [first, last) at column `at`; of four lines, each begins and ends a point after the one before.
template <bool residuals = true, class Real>
inline __attribute__((always_inline)) RunLine<Real> line_through(const Series& s, std::size_t first, std::size_t last,
                                                                 const Real& at) {
  const double *const column = s.column.data() + first, *const position = s.position.data() + first,
                      *const weight = s.weight.data() + first;
  return fit_line<residuals, Real>(
      static_cast<int>(last - first), at, [=](int k) __attribute__((always_inline)) {
        return LinePoint<Real>{load<Real>(column + k), load<Real>(position + k), load<Real>(weight + k)};
      });
}

TANKRIG_VECTORISED
void fit_lines_around(const Series& s, std::size_t i, std::size_t reach, RunLine<FourDoubles>& lines) {
  lines = line_through(s, i - reach, i + reach + 1, load<FourDoubles>(s.column.data() + i));
}

/// Chi-square of two degrees of freedom that the lines through [first, i) and [i, last) are one, at the column between them.
template <class Real>
inline __attribute__((always_inline)) Real bend_at(const Series& s, std::size_t first, std::size_t i, std::size_t last,
                                                   double correlation) {
  const Real column = 0.5 * (load<Real>(s.column.data() + i - 1) + load<Real>(s.column.data() + i));
  const RunLine<Real> left = line_through<false>(s, first, i, column), right = line_through<false>(s, i, last, column);
  const Real a = left.variance + right.variance, b = left.covariance + right.covariance,
             c = left.slope_variance + right.slope_variance;
  const Real dv = left.value - right.value, ds = left.slope - right.slope, determinant = a * c - b * b;
  const Real chi2 = (c * dv * dv - 2 * b * dv * ds + a * ds * ds) / determinant / correlation;
  return left.ok & right.ok & (determinant > 0) ? chi2 : Real{};
}

TANKRIG_VECTORISED
void bends_from(const Series& s, std::size_t i, std::size_t side, double correlation, double* chi2) {
  const FourDoubles bends = bend_at<FourDoubles>(s, i - side, i, i + side, correlation);
  std::memcpy(chi2, &bends, sizeof bends);
}

/// Whether a bend of that chi-square is a corner: of the parabola through both sides, two lines leave less.
bool is_corner(const Series& s, std::size_t first, std::size_t last, double correlation, double chi2) {
  constexpr double kCornerPrice = 2;
  const RunLine line = line_through(s, first, last, s.column[first]);
  const double of_bend = line.bend_variance > 0 ? line.bend * line.bend / line.bend_variance : 0;
  return chi2 - of_bend / correlation > kCornerPrice;
}

/// The evidence that the run bends before each of its points, by `side` columns on either side, where it is more.
void find_bends(const Series& s, int side, double correlation, std::vector<double>& evidence) {
  constexpr std::size_t kLeast = 4;
  const auto reach = static_cast<std::size_t>(side);
  std::size_t first = 0, last = 0;
  for (std::size_t i = 1; i < s.size(); ++i) {
    if (std::isinf(evidence[i])) continue;
    double chi2[kLanes] = {};
    std::size_t count = 1;
    if (s.whole(static_cast<std::ptrdiff_t>(i) - side, static_cast<std::ptrdiff_t>(i + reach + kLanes) - 1)) {
      bends_from(s, i, reach, correlation, chi2);
      count = kLanes;
    } else {
      const double column = 0.5 * (s.column[i - 1] + s.column[i]);
      while (column - s.column[first] >= side) ++first;
      for (last = std::max(last, i); last < s.size() && s.column[last] - column < side;) ++last;
      if (i - first >= kLeast && last - i >= kLeast) chi2[0] = bend_at<double>(s, first, i, last, correlation);
    }
    for (std::size_t k = 0; k < count; ++k) {
      if (chi2[k] < kBendPrice) continue;
      const std::size_t from = count > 1 ? i + k - reach : first, to = count > 1 ? i + k + reach : last;
      if (is_corner(s, from, to, correlation, chi2[k])) evidence[i + k] = std::max(evidence[i + k], chi2[k]);
    }
    i += count - 1;
  }
}

/// Points before which the run bends, steps or has a gap.
std::vector<std::size_t> breaks_of(const Series& run, int reach, double correlation) {
  const std::size_t n = run.size();
  std::vector<double> evidence(n, 0.0);
  for (std::size_t i = 1; i < n; ++i)
    if (run.column[i] - run.column[i - 1] > kMaxGap + 1) evidence[i] = HUGE_VAL;
  for (const int side : {reach, reach / 2})
    if (side >= 4) find_bends(run, side, correlation, evidence);
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
void scale_locally(const Series& s, const std::vector<double>& residuals, FittedRun& run) {
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
  const double image = mean_square(all_single, 1, kImagePrior);
  const double image_correlation = mean_square(all_blocked, image, kImagePrior) / image;
  std::vector<double> correlations;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double run = std::clamp(mean_square(single[r], image, kRunPrior), 0.04, 100.0);
    for (RunPoint& point : runs[r]) point.peak.sigma_px *= static_cast<float>(std::sqrt(run));
    const double of_blocks = mean_square(blocked[r], run * image_correlation, kBlockPrior);
    correlations.push_back(std::clamp(of_blocks / run, 1.0, 0.8 * kBlock));
  }
  return correlations;
}

namespace {

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
RunLine<double> line_around(const Series& s, std::size_t i, std::size_t begin, std::size_t end, int reach) {
  std::size_t first = i, last = i + 1;
  while (first > begin && s.column[i] - s.column[first - 1] <= reach) --first;
  while (last < end && s.column[last] - s.column[i] <= reach) ++last;
  return last - first < 3 ? RunLine<double>{} : line_through(s, first, last, s.column[i]);
}

/// By the widest line up to `reach` columns to both sides of point `i` that its points of [begin, end) agree with.
std::optional<Smoothed> smoothed(const Series& s, std::size_t i, std::size_t begin, std::size_t end, int reach,
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
void smooth_piece(const Series& s, std::size_t begin, std::size_t end, int widest, double correlation,
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

void add_long_residuals(const Series& s, std::size_t begin, std::size_t end, double correlation,
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
  const Series raw(run);
  const int widest = half_window > 0 ? half_window : kUsual;
  std::vector<std::size_t> ends = breaks_of(raw, widest, correlation);
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
