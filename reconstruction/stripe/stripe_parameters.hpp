// What a user may set of the stripe detector.
#pragma once

#include "core/config_node.hpp"
#include "reconstruction/stripe/stripe.hpp"

namespace tankrig {

/// The defaults are meant for every image; nothing here needs tuning per scene.
struct StripeParameters {
  StripeOrientation orientation = StripeOrientation::kAuto;
  double min_snr = 3.0;          ///< filtered peak over filtered noise at which a column speaks for a stripe
  double max_step_px = 2.5;      ///< largest move between neighbouring columns of one surface
  int min_run = 8;               ///< shorter runs of columns are particles
  double max_width_ratio = 1.6;  ///< widest accepted profile over the image's typical one
  double max_skew = 1.2;         ///< largest accepted skewness (third standardised moment) of a profile
  double max_second_peak = 0.9;  ///< second line over first: above it the column is ambiguous
  int smoothing_px =
      10;  ///< half window of the local line fit along the stripe; 0: none. Never across a jump or a kink
  double speckle_floor_px = 0.01;  ///< least sigma, what no smoothing takes away
};

/// The rig file's `reconstruction: laser:`.
extern const SettingsTable<StripeParameters> kStripeKeys;

}  // namespace tankrig
