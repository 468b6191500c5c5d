// The first disparity of every pixel, to the pixel: semi-global matching from the left eye and from the right.
#pragma once

#include <opencv2/core.hpp>

namespace tankrig {

/// [px], lower >= 0.
struct DisparityRange {
  double lower;
  double upper;
};

struct CoarseMatchParameters {
  int window_px;  ///< at least; up to 11 px where noise asks for it
  int uniqueness_percent;
};

/// Of the size of the left image.
struct CoarseMatch {
  cv::Mat1f disparity;     ///< [px], steps of 1/16; NaN where there is no unique match
  cv::Mat1f disagreement;  ///< of the match back from the right eye [px]; NaN where that one is missing
};

/// `left`, `right`: rectified grey, NaN outside. Contrast is stretched by one gain for both, so dim pairs match too.
/// `noise`: of either image before it was smoothed, one standard deviation [grey levels].
CoarseMatch match_both_ways(const cv::Mat1f& left, const cv::Mat1f& right, double noise, const DisparityRange& range,
                            const CoarseMatchParameters& parameters);

}  // namespace tankrig
