// Fitted points of a stripe in runs: which to keep, and why not the others.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig {

struct RunPoint {
  StripePeak peak;
  double amplitude = 0;                              ///< of the profile, in the image's own unit
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();  ///< light above the background, per channel, where not clipped
  double colour_sigma = 0;                           ///< of each channel
};

using FittedRun = std::vector<RunPoint>;

/// Takes out the ends of runs that neighbour another run and lie off their own run's line (counted as edge), and runs
/// shorter than min_run (edge between two runs, isolated otherwise).
void drop_edges(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics);

/// Takes out short runs whose colour is significantly another than that of the long ones (counted as isolated): edges
/// of what moved since the dark image, and specks.
void drop_strangers(std::vector<FittedRun>& runs, const StripeParameters& parameters, StripeStatistics& statistics);

}  // namespace tankrig
