// Where the stripe runs through an image, to a pixel or two: what speaks for it in each column, and the path through that.
#pragma once

#include <vector>

#include "reconstruction/stripe/find/stripe_image.hpp"
#include "reconstruction/stripe/find/stripe_path.hpp"
#include "reconstruction/stripe/stripe_parameters.hpp"

namespace tankrig {

struct StripeTrace {
  RidgeCandidates candidates;
  std::vector<StripeRun> runs;
  std::vector<double> sure_rows;  ///< [px] of the look's path, by column, where it is sure of a stripe; NaN elsewhere
  bool weak = false;              ///< noise hides the stripe in some of its columns
};

StripeTrace trace_stripe(const StripeImage& image, const StripeParameters& parameters);

}  // namespace tankrig
