// A laser frame with the stripe that was found in it.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

struct StripePictureOptions {
  std::string title;
  int zoom = 4;
};

/// `image` (8-bit, grey or BGR) with a thin dot at every detected position [px, centre of the top-left pixel (0, 0)],
/// and an inset that magnifies the middle of the stripe, in the corner that hides least of it.  8-bit BGR of the same
/// size.
cv::Mat draw_stripe_frame(const cv::Mat& image, const std::vector<Vector2d>& stripe,
                          const StripePictureOptions& options = {});

}  // namespace tankrig
