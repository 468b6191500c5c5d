#include "reconstruction/stripe/stripe_selection.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr int kNeighbourColumns = 5;  ///< runs this near to each other meet at a jump
constexpr int kEndPoints = 3;         ///< how many points of an end may belong to neither side
constexpr int kLinePoints = 6;

struct Line {
  double value = 0, slope = 0, variance = 0, chi2 = 0;
  int points = 0;
};

/// Weighted line through [first, last), its value and variance at column `at`.
template <class Iterator>
Line fit_line(Iterator first, Iterator last, double at) {
  double s0 = 0, s1 = 0, s2 = 0, y0 = 0, y1 = 0;
  for (Iterator i = first; i != last; ++i) {
    const double w = 1 / (static_cast<double>(i->peak.sigma_px) * i->peak.sigma_px), t = i->peak.column - at;
    s0 += w;
    s1 += w * t;
    s2 += w * t * t;
    y0 += w * i->peak.position;
    y1 += w * t * i->peak.position;
  }
  const double determinant = s0 * s2 - s1 * s1;
  Line line;
  if (!(determinant > 0)) return line;
  line.value = (s2 * y0 - s1 * y1) / determinant;
  line.slope = (s0 * y1 - s1 * y0) / determinant;
  line.variance = s2 / determinant;
  for (Iterator i = first; i != last; ++i) {
    const double r = (i->peak.position - line.value - line.slope * (i->peak.column - at)) / i->peak.sigma_px;
    line.chi2 += r * r;
    ++line.points;
  }
  return line;
}

/// Points at the beginning of [first, last) that lie off the line of those behind them.
template <class Iterator>
int stray_points(Iterator first, Iterator last) {
  int strays = 0;
  for (int i = 0; i < kEndPoints && last - first > i + 1 + kLinePoints / 2; ++i) {
    const Iterator point = first + i, behind = point + 1;
    const Iterator end = behind + std::min<std::ptrdiff_t>(kLinePoints, last - behind);
    const Line line = fit_line(behind, end, point->peak.column);
    const double tolerance = 0.25 + 3.5 * std::sqrt(line.variance + point->peak.sigma_px * point->peak.sigma_px);
    if (std::abs(point->peak.position - line.value) > tolerance) strays = i + 1;
  }
  return strays;
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
    if (static_cast<int>(run.size()) >= parameters.min_run) {
      const int at_end = right[i] ? stray_points(run.rbegin(), run.rend()) : 0;
      run.resize(run.size() - at_end);
      const int at_start = left[i] ? stray_points(run.begin(), run.end()) : 0;
      run.erase(run.begin(), run.begin() + at_start);
      statistics.edge += static_cast<std::uint64_t>(at_start + at_end);
    }
    if (static_cast<int>(run.size()) >= parameters.min_run) continue;
    (left[i] && right[i] ? statistics.edge : statistics.isolated) += run.size();
    run.clear();
  }
  std::erase_if(runs, [](const FittedRun& run) { return run.empty(); });
}

void smooth_run(FittedRun& run, int half_window) {
  const FittedRun raw = run;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const double column = raw[i].peak.column;
    for (int reach = half_window; reach >= 1; reach /= 2) {
      std::size_t first = i, last = i + 1;
      while (first > 0 && column - raw[first - 1].peak.column <= reach) --first;
      while (last < raw.size() && raw[last].peak.column - column <= reach) ++last;
      if (last - first < 3) continue;
      const Line line = fit_line(raw.begin() + static_cast<std::ptrdiff_t>(first),
                                 raw.begin() + static_cast<std::ptrdiff_t>(last), column);
      const double freedom = line.points - 2;
      if (line.points < 3 || line.chi2 > freedom + 2 * std::sqrt(2 * freedom)) continue;
      run[i].peak.position = static_cast<float>(line.value);
      run[i].peak.sigma_px = static_cast<float>(std::sqrt(line.variance));
      break;
    }
  }
}

}  // namespace tankrig
