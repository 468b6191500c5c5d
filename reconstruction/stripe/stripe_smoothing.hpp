// How much a stripe's points scatter along it, and the local line that evens the scatter out.
#pragma once

#include <vector>

#include "reconstruction/stripe/stripe_selection.hpp"

namespace tankrig {

/// From third differences along the runs, by medians: smooth curves, corners and jumps hardly count. Multiplies the
/// sigmas by what they were too small, in the image and then in each run as far as its length lets tell; returns each
/// run's correlation: the variance of a mean of neighbours over that of as many independent points, for speckle is coarse.
std::vector<double> calibrate_sigmas(std::vector<FittedRun>& runs);

/// Replaces each point by the line through its neighbours within `half_window` columns, bent as far as the lines up to
/// `half_window` columns away tell that the run is. A window ends at a corner, a step or a gap of the run, and is halved
/// until its points agree with a line within their sigmas.
void smooth_run(FittedRun& run, int half_window, double correlation);

}  // namespace tankrig
