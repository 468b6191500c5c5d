// Weighted straight lines through fitted points of a stripe.
#pragma once

#include <cmath>

#include "reconstruction/stripe/stripe_selection.hpp"

namespace tankrig {

/// Units: pixels; value and variance at the column the line was asked for.
struct RunLine {
  double value = 0, slope = 0;
  double variance = 0, slope_variance = 0, covariance = 0;
  double chi2 = 0;
  double bend = 0;  ///< of a parabola [px per column^2]
  double bend_variance = 0;
  double bend_at = 0;  ///< what a bend of one adds to the value
  int points = 0;
  bool ok = false;
};

/// Line through [first, last), any random-access iterator over RunPoint, at column `at`; without `residuals` no chi2
/// and no bend.
template <bool residuals = true, class Iterator>
RunLine fit_line(Iterator first, Iterator last, double at) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, y0 = 0, y1 = 0;
  for (Iterator i = first; i != last; ++i) {
    const double w = 1 / (static_cast<double>(i->peak.sigma_px) * i->peak.sigma_px), t = i->peak.column - at;
    s0 += w;
    s1 += w * t;
    s2 += w * t * t;
    if constexpr (residuals) {
      s3 += w * t * t * t;
      s4 += w * t * t * t * t;
    }
    y0 += w * i->peak.position;
    y1 += w * t * i->peak.position;
  }
  const double determinant = s0 * s2 - s1 * s1;
  RunLine line;
  line.points = static_cast<int>(last - first);
  if (line.points < 2 || !(determinant > 0)) return line;
  line.ok = true;
  line.value = (s2 * y0 - s1 * y1) / determinant;
  line.slope = (s0 * y1 - s1 * y0) / determinant;
  line.variance = s2 / determinant;
  line.slope_variance = s0 / determinant;
  line.covariance = -s1 / determinant;
  if constexpr (!residuals) return line;
  double bend = 0;
  for (Iterator i = first; i != last; ++i) {
    const double t = i->peak.column - at, r = (i->peak.position - line.value - line.slope * t) / i->peak.sigma_px;
    line.chi2 += r * r;
    bend += r / i->peak.sigma_px * t * t;
  }
  const double constant = (s2 * s2 - s1 * s3) / determinant;  // of the line nearest to t^2
  const double power = s4 - constant * s2 - s3 * (s0 * s3 - s1 * s2) / determinant;
  if (line.points > 3 && power > 1e-9 * s4) {
    line.bend = bend / power;
    line.bend_variance = 1 / power;
    line.bend_at = -constant;
  }
  return line;
}

}  // namespace tankrig
