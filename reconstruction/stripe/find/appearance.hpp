// What the stripe looks like in one image: its colour and its width, measured on some of its columns.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>

#include "reconstruction/stripe/find/stripe_look.hpp"

namespace tankrig {

struct StripeAppearance {
  std::array<float, 3> detection{};  ///< channel weights that tell it from noise and texture: covariance^-1 * colour
  std::array<float, 3> profile{};    ///< unit-norm channel weights for the sub-pixel fit
  std::array<float, 3> light{};      ///< unit-norm, none negative: the stripe's own colour
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();  ///< light of each channel where none is clipped; 0: not known
  double noise = 0;    ///< sd of a pixel's value under `profile`, where there is no stripe
  double sd_px = 1.5;  ///< Gaussian sd of the profile
  /// Of the laser's light, the channel that shows least: what is left where the others clip. None in a grey image, and where
  /// a dark image tells the haze.
  std::array<float, 3> faintest{};
  double faintest_sd_px = 0;  ///< of its profile where the stripe clips; 0: hardly anywhere
};

/// `image`: stripe across the columns, 8-bit, 1 or 3 channels; `background` alike or empty.
StripeAppearance measure_appearance(const cv::Mat& image, const cv::Mat& background, const StripeLook& look);

}  // namespace tankrig
