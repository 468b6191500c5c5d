// Fitted points of a stripe in runs: which to keep, and why not the others.
#pragma once

#include <vector>

#include "reconstruction/stripe/fit/section_colour.hpp"
#include "reconstruction/stripe/stripe_parameters.hpp"

namespace tankrig {

struct RunPoint {
  StripePeak peak;
  double amplitude = 0;  ///< of the profile, in the image's own unit
  SectionColour colour;
  double edge_px = 0;  ///< of the peak's sigma, what no neighbour makes smaller
};

using FittedRun = std::vector<RunPoint>;

/// Takes out the ends of runs that neighbour another run and lie off their own run's line (counted as edge), and runs
/// shorter than min_run (edge between two runs, isolated otherwise).
void drop_edges(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics);

/// Takes out (counted as isolated) runs that add no light to the scene's, as a red cable, whose other channels are darker
/// than what lies beside it; and short runs whose colour is significantly another than that of the long ones: edges of
/// what moved since the dark image, and specks.
void drop_strangers(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics);

}  // namespace tankrig
