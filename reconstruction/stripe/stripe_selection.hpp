// Fitted points of a stripe in runs: which to keep, and why not the others.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig {

/// Of a section across the stripe, or of several: light above what lies beside it, per channel, where not clipped.
struct SectionColour {
  Eigen::Vector3d light = Eigen::Vector3d::Zero();
  double variance = 0;  ///< of each channel

  SectionColour& operator+=(const SectionColour& other) {
    light += other.light;
    variance += other.variance;
    return *this;
  }
};

/// Whether `light` is off the direction `stripe`, of unit length, by more than `tolerance` and more than the camera's
/// response may turn it.
bool is_another_colour(const Eigen::Vector3d& light, double tolerance, const Eigen::Vector3d& stripe);

struct RunPoint {
  StripePeak peak;
  double amplitude = 0;  ///< of the profile, in the image's own unit
  SectionColour colour;
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
