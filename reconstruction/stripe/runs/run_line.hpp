// Weighted straight lines through fitted points of a stripe.
#pragma once

#include "reconstruction/stripe/lanes.hpp"

namespace tankrig {

/// `Real`: a double, or four of as many lines. Units: pixels.
template <class Real>
struct alignas(kLaneAlignment) LinePoint {
  Real column, position, weight;  ///< the last: of the position, 1 / sigma^2
};

/// Units: pixels; value and variance at the column the line was asked for.
template <class Real>
struct alignas(kLaneAlignment) RunLine {
  Mask<Real> ok = {};
  Real value = {}, slope = {};
  Real variance = {}, slope_variance = {}, covariance = {};
  Real chi2 = {};
  Real bend = {};  ///< of a parabola [px per column^2]
  Real bend_variance = {};
  Real bend_at = {};  ///< what a bend of one adds to the value
  int points = 0;
};

inline RunLine<double> lane_of(const RunLine<FourDoubles>& lines, int k) {
  return {lines.ok[k] != 0,        lines.value[k],      lines.slope[k], lines.variance[k],
          lines.slope_variance[k], lines.covariance[k], lines.chi2[k],  lines.bend[k],
          lines.bend_variance[k],  lines.bend_at[k],    lines.points};
}

/// Line through point(0) to point(points - 1), a LinePoint each, at column `at`; without `residuals` no chi2 and no bend.
template <bool residuals = true, class Real, class Point>
inline __attribute__((always_inline)) RunLine<Real> fit_line(int points, const Real& at, Point point) {
  Real s0 = {}, s1 = {}, s2 = {}, s3 = {}, s4 = {}, y0 = {}, y1 = {};
  for (int i = 0; i < points; ++i) {
    const LinePoint<Real> p = point(i);
    const Real t = p.column - at, wt = p.weight * t, wtt = wt * t;
    s0 += p.weight;
    s1 += wt;
    s2 += wtt;
    if constexpr (residuals) {
      s3 += wtt * t;
      s4 += wtt * t * t;
    }
    y0 += p.weight * p.position;
    y1 += wt * p.position;
  }
  const Real determinant = s0 * s2 - s1 * s1;
  RunLine<Real> line;
  line.points = points;
  line.ok = determinant > 0;
  if (points < 2) line.ok = Mask<Real>{};
  line.value = (s2 * y0 - s1 * y1) / determinant;
  line.slope = (s0 * y1 - s1 * y0) / determinant;
  line.variance = s2 / determinant;
  line.slope_variance = s0 / determinant;
  line.covariance = -s1 / determinant;
  if constexpr (!residuals) return line;
  Real bend = {};
  for (int i = 0; i < points; ++i) {
    const LinePoint<Real> p = point(i);
    const Real t = p.column - at, r = p.position - line.value - line.slope * t, wr = p.weight * r;
    line.chi2 += wr * r;
    bend += wr * t * t;
  }
  const Real constant = (s2 * s2 - s1 * s3) / determinant;  // of the line nearest to t^2
  const Real power = s4 - constant * s2 - s3 * (s0 * s3 - s1 * s2) / determinant;
  const Mask<Real> bends = power > 1e-9 * s4;
  if (points > 3) {
    line.bend = bends ? bend / power : line.bend;
    line.bend_variance = bends ? 1 / power : line.bend_variance;
    line.bend_at = bends ? -constant : line.bend_at;
  }
  return line;
}

}  // namespace tankrig
