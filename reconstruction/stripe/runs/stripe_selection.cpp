#include "reconstruction/stripe/runs/stripe_selection.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruction/stripe/runs/run_line.hpp"

namespace tankrig {
namespace {

constexpr int kNeighbourColumns = 5;  ///< runs this near to each other meet at a jump
constexpr int kEndPoints = 3;         ///< how many points of an end may belong to neither side
constexpr int kLinePoints = 6;

/// Points at the beginning of [first, last) that lie off the line of those behind them.
template <class Iterator>
int stray_points(Iterator first, Iterator last) {
  int strays = 0;
  for (int i = 0; i < kEndPoints && last - first > i + 1 + kLinePoints / 2; ++i) {
    const Iterator point = first + i, behind = point + 1;
    const Iterator end = behind + std::min<std::ptrdiff_t>(kLinePoints, last - behind);
    const RunLine line = fit_line<false>(static_cast<int>(end - behind), double{point->peak.column}, [&](int k) {
      const StripePeak& peak = behind[k].peak;
      return LinePoint<double>{peak.column, peak.position, 1 / (static_cast<double>(peak.sigma_px) * peak.sigma_px)};
    });
    const double tolerance = 0.25 + 3.5 * std::sqrt(line.variance + point->peak.sigma_px * point->peak.sigma_px);
    if (std::abs(point->peak.position - line.value) > tolerance) strays = i + 1;
  }
  return strays;
}

/// Points at the beginning of [first, last) much fainter than those behind them: beyond the surface's edge, seen only
/// in the blur of its last columns and drawn towards them.
template <class Iterator>
int fading_points(Iterator first, Iterator last) {
  constexpr int kFadingPoints = 4, kBehind = 7;
  constexpr double kEdgeShare = 0.7;  // a blurred edge lies at half; up to here it draws the profile along
  if (last - first < kFadingPoints + kBehind) return 0;
  std::array<double, kBehind> behind;
  for (int i = 0; i < kBehind; ++i) behind[i] = (first + kFadingPoints + i)->amplitude;
  std::nth_element(behind.begin(), behind.begin() + kBehind / 2, behind.end());
  int fading = 0;
  while (fading < kFadingPoints && (first + fading)->amplitude < kEdgeShare * behind[kBehind / 2]) ++fading;
  return fading;
}

/// Takes points off either end; returns how many.
std::uint64_t trim(FittedRun& run, int at_start, int at_end) {
  run.resize(run.size() - at_end);
  run.erase(run.begin(), run.begin() + at_start);
  return static_cast<std::uint64_t>(at_start + at_end);
}

bool meet(const FittedRun& left, const FittedRun& right) {
  return !left.empty() && !right.empty() && right.front().peak.column - left.back().peak.column <= kNeighbourColumns;
}

}  // namespace

void drop_edges(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics) {
  std::vector<bool> left(runs.size()), right(runs.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    left[i] = i > 0 && meet(runs[i - 1], runs[i]);
    right[i] = i + 1 < runs.size() && meet(runs[i], runs[i + 1]);
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    FittedRun& run = runs[i];
    statistics.edge += trim(run, fading_points(run.begin(), run.end()), fading_points(run.rbegin(), run.rend()));
    if (static_cast<int>(run.size()) >= parameters.min_run) {
      const int at_end = right[i] ? stray_points(run.rbegin(), run.rend()) : 0;
      statistics.edge += trim(run, 0, at_end);
      const int at_start = left[i] ? stray_points(run.begin(), run.end()) : 0;
      statistics.edge += trim(run, at_start, 0);
    }
    if (static_cast<int>(run.size()) >= parameters.min_run) continue;
    (left[i] && right[i] ? statistics.edge : statistics.isolated) += run.size();
    run.clear();
  }
}

void drop_strangers(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics) {
  constexpr int kShort = 4;  // in shortest runs
  constexpr double kSigmas = 4;
  constexpr double kAdded = 0.4;  // a camera may lower the other channels, together, by half of what one gains
  const auto is_long = [&](const FittedRun& run) {
    return static_cast<int>(run.size()) >= kShort * parameters.min_run;
  };
  const auto colour_of = [](const FittedRun& run) {
    SectionColour colour;
    for (const RunPoint& point : run) colour += point.colour;
    return colour;
  };
  const auto is_hidden = [](const FittedRun& run) {
    return 2 * std::ranges::count_if(run, [](const RunPoint& p) { return p.colour.hidden; }) > std::ssize(run);
  };
  std::erase_if(runs, [&](const FittedRun& run) {
    if (is_hidden(run)) return false;
    const SectionColour colour = colour_of(run);
    const double size = colour.light.norm(), sigma = std::sqrt(colour.variance);
    if (!(colour.light.sum() + kSigmas * sigma < kAdded * size)) return false;
    statistics.isolated += run.size();
    return true;
  });
  Eigen::Vector3d stripe = Eigen::Vector3d::Zero();
  for (const FittedRun& run : runs)
    if (is_long(run))
      for (const RunPoint& point : run) stripe += point.colour.light;
  if (!(stripe.norm() > 0)) return;
  stripe.normalize();
  std::erase_if(runs, [&](const FittedRun& run) {
    if (is_long(run) || is_hidden(run)) return false;
    const SectionColour colour = colour_of(run);
    if (!is_another_colour(colour.light, kSigmas * std::sqrt(colour.variance), stripe)) return false;
    statistics.isolated += run.size();
    return true;
  });
}

}  // namespace tankrig
