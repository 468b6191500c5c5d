// How the stripe lies in an image and what colour it has: found by its length, before anything is known of it.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "reconstruction/stripe/stripe.hpp"

namespace tankrig {

/// What a stripe looks like in an image reduced to a few hundred pixels.
struct StripeLook {
  StripeOrientation orientation = StripeOrientation::kColumns;  ///< never kAuto
  std::array<float, 3> weights{};  ///< of the channels: the stripe's colour against the scene's; unit norm
  double sd_px = 1.5;              ///< of the filter that answers best [px of the image]
  double evidence = 0;             ///< of the path through its columns; see best_path()
  double rival = 0;                ///< of the best path across the other orientation
  double share = 0;                ///< of the columns that the path crosses
  std::vector<float> rows;         ///< the path: a row [px] every `step` columns, NaN where there is none
  int step = 1;
  /// Of speckle: noise in proportion to the light, as a share of it. Settled for a set of images; none: by each image.
  std::optional<double> contrast;
};

/// The clearest look among laser colours, widths and the orientations that `orientation` allows.
/// `image`: 8-bit, 1 or 3 (BGR) channels; `background` alike or empty.
StripeLook find_look(const cv::Mat& image, const cv::Mat& background, StripeOrientation orientation);

/// Where a stripe of a known orientation, colour and width runs in this image. One that is clear beside a dark image is
/// followed in a few columns: the other rows are NaN then, and the evidence is 0.
StripeLook follow_look(const cv::Mat& image, const cv::Mat& background, const StripeLook& known);

}  // namespace tankrig
