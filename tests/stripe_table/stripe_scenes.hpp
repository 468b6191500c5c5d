// A second generator of stripe images with known truth, for the table of detectors. It shares no code with the
// simulator of sim_backends/world: profiles, light and scenes are written down here once more, in another way.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace tankrig {

/// Truth: the row of the stripe's core at each column [px]; NaN where there is no stripe.
struct StripeScene {
  std::string name;
  std::vector<double> truth;
  cv::Mat image;        ///< 8-bit, BGR or grey
  cv::Mat background;   ///< the same without laser and with other noise; empty where the scene has no dark frame
  double bound_px = 0;  ///< Cramer-Rao bound of the position from read and shot noise alone; 0 where it is not known
};

/// The scenes of the table, in its order: profiles (Gaussian, thin, wide, flat-topped, skewed, speckled), clipped cores
/// with coloured skirts, boards, lit rooms with and without a dark frame, JPEG, diagonal stripes, segments, weak
/// stripes, grey images and a scene without a stripe. `seed` chooses noise and speckle.
std::vector<StripeScene> stripe_scenes(std::uint64_t seed);

}  // namespace tankrig
