// What the stripe looks like in one image: its colour and its width, measured on some of its columns.
#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace tankrig {

struct StripeAppearance {
  std::array<float, 3> detection{};  ///< channel weights that tell it from noise and texture: covariance^-1 * colour
  std::array<float, 3> profile{};    ///< unit-norm channel weights for the sub-pixel fit
  double noise = 0;                  ///< sd of a pixel's value under `profile`, where there is no stripe
  double sd_px = 1.5;                ///< Gaussian sd of the profile
  double score = 0;                  ///< typical SNR of a column's best peak
};

/// `image`: stripe across the columns, 8-bit, 1 or 3 channels; `background` alike or empty.
StripeAppearance measure_appearance(const cv::Mat& image, const cv::Mat& background);

}  // namespace tankrig
