// The local line along a stripe that evens out what its points scatter.
#pragma once

#include "reconstruction/stripe/runs/stripe_selection.hpp"

namespace tankrig {

/// Replaces each point by the line through its neighbours within `half_window` columns, bent as far as the lines up to
/// `half_window` columns away tell that the run is. A window ends at a corner, a step or a gap of the run, and is halved
/// until its points agree with a line within their sigmas.
void smooth_run(FittedRun& run, int half_window, double correlation);

}  // namespace tankrig
