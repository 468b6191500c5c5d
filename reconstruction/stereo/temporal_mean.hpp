// Many images of a scene at rest become one: noise averages down, particles that drift through drop out.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

struct TemporalMean {
  cv::Mat1f mean;      ///< per pixel, of the samples near the pixel's median [grey levels of 255]
  cv::Mat1f variance;  ///< of `mean`; never below the quantisation's [grey levels^2]
  double noise = 0;    ///< of one image, one standard deviation, median over the image [grey levels]
};

/// `images`: 8-bit grey, equal sizes, at least one. The noise is measured from image to image in blocks of
/// 16 x 16 pixels, robust against what passes through; a pixel's samples farther than 3 deviations from its median are
/// left out. From a single image the noise is what its smoothest tenth shows.
TemporalMean temporal_mean(const std::vector<cv::Mat1b>& images);

}  // namespace tankrig
