// Our grey pictures as ViSP's.
#pragma once

#include <visp3/core/vpImage.h>

#include <opencv2/core.hpp>

namespace tankrig {

/// A copy of `grey`: 8 bits, one channel.
inline vpImage<unsigned char> to_visp(const cv::Mat& grey) {
  vpImage<unsigned char> image(static_cast<unsigned>(grey.rows), static_cast<unsigned>(grey.cols));
  for (int row = 0; row < grey.rows; ++row) std::copy_n(grey.ptr(row), grey.cols, image[static_cast<unsigned>(row)]);
  return image;
}

}  // namespace tankrig
