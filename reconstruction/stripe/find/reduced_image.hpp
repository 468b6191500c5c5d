// An image reduced to a few hundred pixels, in which a stripe is found by its length.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

/// By channel: the image less its background; and what share of each reduced pixel is clipped, empty where none is.
struct ReducedImage {
  std::vector<cv::Mat1f> light, clipped;
  int factor = 1;
};

/// How many pixels of the image become one, along each side.
int reduction_of(const cv::Mat& image);

/// `image`: 8-bit, 1 or 3 channels; `background` alike or empty. A rest of fewer pixels than the factor is left out.
ReducedImage reduce(const cv::Mat& image, const cv::Mat& background);

ReducedImage transposed(const ReducedImage& image);

/// Light in the given colour. What is clipped in one of its channels is at least as bright as what surrounds it.
cv::Mat1f signal_of(const ReducedImage& image, const std::array<float, 3>& weights);

/// Light of all channels.
cv::Mat1f sum_of(const ReducedImage& image);

}  // namespace tankrig
