// Fitted points of a stripe in runs: which to keep, and the local line along each run.
#pragma once

#include <vector>

#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig {

struct RunPoint {
  StripePeak peak;
};

using FittedRun = std::vector<RunPoint>;

/// Takes out the ends of runs that neighbour another run and lie off their own run's line (counted as edge), and runs
/// shorter than min_run (edge between two runs, isolated otherwise).
void drop_edges(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics);

/// Replaces each point by the line through its neighbours within `half_window` columns where they agree with a line
/// within their sigmas, trying half the window before leaving the point as it is.
void smooth_run(FittedRun& run, int half_window);

}  // namespace tankrig
