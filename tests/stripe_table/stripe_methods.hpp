// What each detector of the table finds in one image.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "reconstruction/stripe/stripe.hpp"

namespace tankrig {

enum StripeMethod { kRaw, kSmooth, kSteger, kParabola, kMass, kPaper, kMethods };
inline constexpr std::array kMethodNames{"ours, not smoothed", "ours",           "Steger",
                                         "log-parabola",       "centre of mass", "paper"};

/// By column (by row, for kRows): NaN where nothing is found, and where a peer has no sigma.
struct FoundStripe {
  std::vector<double> position, sigma;
};

/// `orientation` and `channel` (the laser's: 0 B, 1 G, 2 R) are told to the peers; ours finds both. A detection across
/// the other direction counts as nothing found.
std::array<FoundStripe, kMethods> detect_by_all(const cv::Mat& image, const cv::Mat& background,
                                                StripeOrientation orientation, int channel);

}  // namespace tankrig
