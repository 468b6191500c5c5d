// How sure the figures of one cloud are: 95 % intervals by drawing its frames again.
#pragma once

#include <array>
#include <optional>

#include "bench/metrics/metrics.hpp"

namespace tankrig {

/// Lower and upper bound, 2.5 % of the draws beyond each.
using Interval = std::array<double, 2>;

struct ErrorIntervals {
  std::optional<Interval> mean, stddev;  ///< [m]; none without object points
  std::optional<Interval> outliers;      ///< share
  std::size_t groups = 0;                ///< what was drawn: frames, or blocks
  bool by_frame = true;
};

/// Points of one frame share its error, so whole frames are drawn with replacement, 1000 times. A cloud of fewer than
/// ten frames (stereo, whose pairs are averaged) is cut into cubes of 20 mm instead. The same every time.
/// Coverage is not drawn: fewer frames cover less, whatever the noise. Its sampling error is in Coverage::whole_sigma.
ErrorIntervals bootstrap_errors(const PointCloud& cloud, const Metrics& metrics);

}  // namespace tankrig
