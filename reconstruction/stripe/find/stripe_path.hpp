// The stripe's way through the candidates of all columns.
#pragma once

#include <vector>

#include "reconstruction/stripe/find/ridge_filter.hpp"

namespace tankrig {

struct PathPoint {
  int column = 0;
  RidgeCandidate candidate;
};

/// A piece of the stripe without a jump, in order of columns; columns may be missing.
using StripeRun = std::vector<PathPoint>;

/// The runs that together have the most evidence: each point gives log(snr / min_snr), limited so that a bright speck
/// does not outbid the stripe; a move between neighbouring columns of up to `max_step_px` is nearly free, everything
/// else ends a run and starts another at a fixed price. A run that does not earn its price is noise.
std::vector<StripeRun> best_path(const RidgeCandidates& candidates, double min_snr, double max_step_px,
                                 double typical_snr);

}  // namespace tankrig
