#include "reconstruction/stripe/runs/run_breaks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr int kMaxGap = 3;         ///< missing columns over which a line is drawn
constexpr double kBendPrice = 22;  ///< chi-square, of two degrees of freedom, above which two lines are better than one

/// Chi-square of two degrees of freedom that the lines through [first, i) and [i, last) are one, at the column between them.
template <class Real>
inline __attribute__((always_inline)) Real bend_at(const RunSeries& s, std::size_t first, std::size_t i,
                                                   std::size_t last, double correlation) {
  const Real column = 0.5 * (load<Real>(s.column.data() + i - 1) + load<Real>(s.column.data() + i));
  const RunLine<Real> left = line_through<false>(s, first, i, column), right = line_through<false>(s, i, last, column);
  const Real a = left.variance + right.variance, b = left.covariance + right.covariance,
             c = left.slope_variance + right.slope_variance;
  const Real dv = left.value - right.value, ds = left.slope - right.slope, determinant = a * c - b * b;
  const Real chi2 = (c * dv * dv - 2 * b * dv * ds + a * ds * ds) / determinant / correlation;
  return left.ok & right.ok & (determinant > 0) ? chi2 : Real{};
}

TANKRIG_VECTORISED
void bends_from(const RunSeries& s, std::size_t i, std::size_t side, double correlation, double* chi2) {
  const FourDoubles bends = bend_at<FourDoubles>(s, i - side, i, i + side, correlation);
  std::memcpy(chi2, &bends, sizeof bends);
}

/// Whether a bend of that chi-square is a corner: of the parabola through both sides, two lines leave less.
bool is_corner(const RunSeries& s, std::size_t first, std::size_t last, double correlation, double chi2) {
  constexpr double kCornerPrice = 2;
  const RunLine line = line_through(s, first, last, s.column[first]);
  const double of_bend = line.bend_variance > 0 ? line.bend * line.bend / line.bend_variance : 0;
  return chi2 - of_bend / correlation > kCornerPrice;
}

/// The evidence that the run bends before each of its points, by `side` columns on either side, where it is more.
void find_bends(const RunSeries& s, int side, double correlation, std::vector<double>& evidence) {
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

}  // namespace

std::vector<std::size_t> find_breaks(const RunSeries& run, int reach, double correlation) {
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

}  // namespace tankrig
