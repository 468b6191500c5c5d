// Where a run bends like a corner, steps or has a gap: no line goes across.
#pragma once

#include <cstddef>
#include <vector>

#include "reconstruction/stripe/runs/run_series.hpp"

namespace tankrig {

/// The points before which it does. `reach`: columns on either side that are asked for a bend; `correlation`: as of
/// calibrate_sigmas.
std::vector<std::size_t> find_breaks(const RunSeries& run, int reach, double correlation);

}  // namespace tankrig
