#include "reconstruction/stripe/fit/one_sided_haze.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/median.hpp"
#include "reconstruction/stripe/find/ridge_filter.hpp"

namespace tankrig {
namespace {

constexpr double kReach = 10;               ///< [sd] to either side of the stripe that is looked at
constexpr double kBin = 0.5;                ///< [px] of the mean profile
constexpr double kMedianOverMean = 1.2533;  ///< sd of a median over that of the mean of normal values

/// Takes the values' order.
double sigma_of_median(std::vector<double>& values, double median) {
  for (double& value : values) value = std::abs(value - median);
  return kMedianOverMean * kSdOfMedian * upper_median(values) / std::sqrt(static_cast<double>(values.size()));
}

using Runs = std::vector<std::vector<FittedPoint>>;

/// About so many of the points, evenly, less those that are clipped.
std::vector<FittedPoint> some_of(const SectionFits& sections, const Runs& runs, std::size_t count) {
  std::size_t all = 0, next = 0;
  for (const auto& run : runs) all += run.size();
  const std::size_t step = std::max<std::size_t>(1, all / count);
  std::vector<FittedPoint> some;
  for (const auto& run : runs)
    for (const FittedPoint& p : run)
      if (next++ % step == step / 2 && !sections.is_clipped(p.point)) some.push_back(p);
  return some;
}

/// The light around a point, over its amplitude.
struct Around {
  std::span<const float> light;
  int first;  ///< row
};

Around around(SectionFits& sections, const FittedPoint& p, int reach) {
  const int first = static_cast<int>(std::lround(p.fit.position)) - reach;
  return {sections.light_across(p.point.column, first, first + 2 * reach), first};
}

/// Whether one side is brighter than the other, beyond the core.
bool sides_differ(SectionFits& sections, const Runs& runs, int reach) {
  constexpr std::size_t kPoints = 64, kFew = 24;
  constexpr double kCore = 2.5, kLeast = 0.002, kClearSigmas = 6;  // sd, amplitudes
  const int core = static_cast<int>(std::ceil(kCore * sections.sd()));
  std::vector<double> differences;
  for (const FittedPoint& p : some_of(sections, runs, kPoints)) {
    const std::span<const float> light = around(sections, p, reach).light;
    if (light.empty()) continue;
    double difference = 0;
    for (int k = core; k <= reach; ++k) difference += light[reach + k] - light[reach - k];
    differences.push_back(difference / ((reach + 1 - core) * p.fit.amplitude));
  }
  if (differences.size() < kFew) return false;
  const double typical = upper_median(differences);
  return std::abs(typical) > std::max(kLeast, kClearSigmas * sigma_of_median(differences, typical));
}

/// Whether the profiles lean to one side by more than chance. `typical`: their median skewness.
bool is_skewed(const Runs& runs, double typical) {
  constexpr double kLeast = 0.02, kClearSigmas = 6;
  if (std::abs(typical) < kLeast) return false;
  std::vector<double> skewness;
  for (const auto& run : runs)
    for (const FittedPoint& p : run) skewness.push_back(p.fit.skewness);
  return std::abs(typical) > kClearSigmas * sigma_of_median(skewness, typical);
}

/// Light over the amplitude at distances from the fitted positions, medians of many points.
struct MeanProfile {
  std::vector<double> t, value, weight;  ///< the first in px, the last 1 / sigma
};

MeanProfile mean_profile(SectionFits& sections, const Runs& runs, int reach) {
  constexpr std::size_t kPoints = 200, kLeast = 8;
  constexpr double kKnown = 1e-4;  // no bin is known better
  const auto middle = static_cast<std::ptrdiff_t>(reach / kBin);
  std::vector<std::vector<double>> bins(static_cast<std::size_t>(2 * middle + 1));
  for (const FittedPoint& p : some_of(sections, runs, kPoints)) {
    const auto [light, first] = around(sections, p, reach);
    for (std::size_t i = 0; i < light.size(); ++i) {
      const auto bin = middle + std::lround((first + static_cast<double>(i) - p.fit.position) / kBin);
      if (bin >= 0 && bin < std::ssize(bins)) bins[bin].push_back(light[i] / p.fit.amplitude);
    }
  }
  MeanProfile mean;
  for (std::ptrdiff_t bin = 0; bin < std::ssize(bins); ++bin) {
    if (bins[bin].size() < kLeast) continue;
    mean.t.push_back(static_cast<double>(bin - middle) * kBin);
    mean.value.push_back(upper_median(bins[bin]));
    mean.weight.push_back(1 / (sigma_of_median(bins[bin], mean.value.back()) + kKnown));
  }
  return mean;
}

/// Light that begins at 0 and falls off over `length`, blurred by `sd` [px].
double tail(double t, double length, double sd) {
  constexpr double kMost = 50;  // beyond, the other factor is 0
  const double a = sd / length;
  return 0.5 * std::exp(std::min(kMost, 0.5 * a * a - t / length)) * std::erfc((a - t / sd) / std::sqrt(2.0));
}

/// How haze begins: so far from the middle, so sharply; in the core's sd.
struct Beginning {
  double beside, blur;
};

/// The light is linear in the first five.
enum Unknown { kCoreLight, kHazeAbove, kHazeBelow, kLevel, kLevelSlope, kMiddle, kCoreSd, kTailLength, kUnknowns };
constexpr int kLinear = kMiddle;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using LinearRow = Eigen::Matrix<double, 1, kLinear>;

struct HazeFit {
  Unknowns values = Unknowns::Zero();
  double misfit = HUGE_VAL;  ///< chi-square over the degrees of freedom
  double middle_sigma = 0;
};

LinearRow linear_row(const Unknowns& v, double x, const Beginning* haze) {
  const double t = x - v[kMiddle], sd = v[kCoreSd];
  LinearRow row(std::exp(-0.5 * t * t / (sd * sd)), 0, 0, 1, x);
  if (haze) {
    row[kHazeAbove] = tail(-t - haze->beside * sd, v[kTailLength], haze->blur * sd);
    row[kHazeBelow] = tail(t - haze->beside * sd, v[kTailLength], haze->blur * sd);
  }
  return row;
}

/// A Gaussian core, haze above and below it, and a straight background, by Gauss-Newton. `haze`: none: without.
HazeFit fit_haze(const MeanProfile& mean, double start_sd, const Beginning* haze) {
  constexpr int kRounds = 20;
  constexpr double kDifference = 1e-4, kEnough = 1e-3, kStartLength = 4;
  const auto n = static_cast<Eigen::Index>(mean.t.size());
  const auto weight = Eigen::ArrayXd::Map(mean.weight.data(), n);
  const Eigen::VectorXd right = weight * Eigen::ArrayXd::Map(mean.value.data(), n);
  Eigen::Matrix<double, Eigen::Dynamic, kUnknowns> rows(n, static_cast<int>(kUnknowns));
  HazeFit fit;
  Unknowns& v = fit.values;
  v[kCoreSd] = start_sd;
  v[kTailLength] = kStartLength * start_sd;
  const auto move = [&](int k, double step, double most, double low, double high) {
    v[k] = std::clamp(v[k] + std::clamp(step, -most, most), low, high);
  };
  for (int round = 0; round < kRounds; ++round) {
    for (Eigen::Index i = 0; i < n; ++i) rows.row(i).head<kLinear>() = weight[i] * linear_row(v, mean.t[i], haze);
    const auto linear = rows.leftCols<kLinear>();
    v.head<kLinear>() = linear.completeOrthogonalDecomposition().solve(right);
    const Eigen::VectorXd residual = right - linear * v.head<kLinear>();
    fit.misfit = residual.squaredNorm() / static_cast<double>(n - kUnknowns);
    for (int k = kMiddle; k < kUnknowns; ++k) {
      Unknowns moved = v;
      moved[k] += kDifference;
      for (Eigen::Index i = 0; i < n; ++i)
        rows(i, k) =
            (weight[i] * linear_row(moved, mean.t[i], haze) - linear.row(i)).dot(v.head<kLinear>()) / kDifference;
    }
    const auto solver = rows.completeOrthogonalDecomposition();
    const Unknowns step = solver.solve(residual);
    fit.middle_sigma = solver.pseudoInverse().row(kMiddle).norm() * std::sqrt(std::max(1.0, fit.misfit));
    move(kMiddle, step[kMiddle], 0.3 * start_sd, -start_sd, start_sd);
    move(kCoreSd, step[kCoreSd], 0.2 * start_sd, 0.4 * start_sd, 1.5 * start_sd);
    move(kTailLength, step[kTailLength], 0.5 * v[kTailLength], 0.7 * start_sd, 20 * start_sd);
    if (std::abs(step[kMiddle]) < kEnough && std::abs(step[kCoreSd]) < kEnough) break;
  }
  return fit;
}

/// Whether light is added beside the core, and hardly any taken.
bool is_haze(const HazeFit& fit) {
  constexpr double kNone = 0.1;
  const double above = fit.values[kHazeAbove], below = fit.values[kHazeBelow], most = std::max(above, below);
  return most > 0 && std::min(above, below) > -kNone * most;
}

}  // namespace

SharedShift measure_haze(SectionFits& sections, const Runs& runs, double skewness) {
  constexpr double kExplains = 0.5;  // of the misfit without haze
  constexpr double kClear = 4;       // sigmas
  constexpr double kAsWell = 9;      // chi-square
  constexpr double kModel = 0.15;    // of the shift: no haze is quite as one of these
  constexpr Beginning kBeginnings[] = {{0, 0.3}, {0.25, 0.3}, {0, 1}};
  const int reach = static_cast<int>(std::ceil(kReach * sections.sd()));
  if (!is_skewed(runs, skewness) && !sides_differ(sections, runs, reach)) return {};
  const MeanProfile mean = mean_profile(sections, runs, reach);
  if (mean.t.size() < 2 * kUnknowns) return {};
  const HazeFit without = fit_haze(mean, sections.sd(), nullptr);
  std::vector<HazeFit> fits;
  for (const Beginning& beginning : kBeginnings) fits.push_back(fit_haze(mean, sections.sd(), &beginning));
  const HazeFit& best = *std::ranges::min_element(fits, {}, &HazeFit::misfit);
  const double shift = best.values[kMiddle];
  if (!is_haze(best) || best.misfit > kExplains * without.misfit || std::abs(shift) < kClear * best.middle_sigma)
    return {};
  const double unexplained = std::max(1.0, best.misfit);
  double open = 0;  // between those that explain the profile as well
  for (const HazeFit& fit : fits)
    if ((fit.misfit - best.misfit) * static_cast<double>(mean.t.size()) < kAsWell * unexplained)
      open = std::max(open, std::abs(fit.values[kMiddle] - shift));
  return {shift, std::hypot(kModel * shift * std::sqrt(unexplained), open, best.middle_sigma)};
}

}  // namespace tankrig
