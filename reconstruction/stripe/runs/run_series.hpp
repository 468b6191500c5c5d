// A run's points, so that lines through them are quickly fitted.
#pragma once

#include <cstddef>
#include <iterator>
#include <vector>

#include "reconstruction/stripe/runs/run_line.hpp"
#include "reconstruction/stripe/runs/stripe_selection.hpp"

namespace tankrig {

struct RunSeries {
  std::vector<double> column, position, weight;  ///< the last: 1 / sigma^2

  explicit RunSeries(const FittedRun& run) {
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
inline __attribute__((always_inline)) RunLine<Real> line_through(const RunSeries& s, std::size_t first,
                                                                 std::size_t last, const Real& at) {
  const double *const column = s.column.data() + first, *const position = s.position.data() + first,
                      *const weight = s.weight.data() + first;
  return fit_line<residuals, Real>(
      static_cast<int>(last - first), at, [=](int k) __attribute__((always_inline)) {
        return LinePoint<Real>{load<Real>(column + k), load<Real>(position + k), load<Real>(weight + k)};
      });
}

}  // namespace tankrig
