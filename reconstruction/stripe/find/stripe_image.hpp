// One image whose stripe crosses the columns, and what is measured in all of it before any point is fitted.
#pragma once

#include <opencv2/core.hpp>

#include "reconstruction/stripe/find/appearance.hpp"
#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/find/stripe_look.hpp"

namespace tankrig {

struct StripeImage {
  cv::Mat pixels, background;  ///< 8-bit, 1 or 3 channels; the latter is empty where there is no dark image
  const StripeLook& look;
  StripeAppearance appearance;
  ClippedRuns clipped;  ///< of the stripe's light
  /// Of the faintest channel. Where it clips with the stripe's colour on both sides, there is the stripe's core, however
  /// far the others clip in its haze.
  ClippedRuns cores;

  StripeImage(const cv::Mat& image, const cv::Mat& dark, const StripeLook& known)
      : pixels(image),
        background(dark),
        look(known),
        appearance(measure_appearance(image, dark, known)),
        clipped(image, appearance.light),
        cores(image, appearance.faintest) {}
};

}  // namespace tankrig
