// How much a stripe's points scatter along it, and what that says of their sigmas.
#pragma once

#include <vector>

#include "reconstruction/stripe/runs/stripe_selection.hpp"

namespace tankrig {

/// From third differences along the runs, by medians: smooth curves, corners and jumps hardly count. Multiplies the
/// sigmas by what they were too small, in the image and then in each run as far as its length lets tell; returns each
/// run's correlation: the variance of a mean of neighbours over that of as many independent points, for speckle is coarse.
std::vector<double> calibrate_sigmas(std::vector<FittedRun>& runs);

}  // namespace tankrig
