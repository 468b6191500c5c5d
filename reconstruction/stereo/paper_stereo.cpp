// Block matching as ROS's stereo_image_proc runs it.
#include "reconstruction/stereo/paper_stereo.hpp"

#include <opencv2/calib3d.hpp>

#include "reconstruction/stereo/rectifier.hpp"

namespace tankrig {

StereoResult reconstruct_paper(const StereoPair& pair, const StereoCalibration& calibration,
                               const PaperStereoParameters& parameters) {
  const Rectifier rectifier(calibration);
  const cv::Mat1b left = rectifier.left(pair.left);
  const cv::Mat1b right = rectifier.right(pair.right);

  const auto matcher = cv::StereoBM::create(parameters.disparity_range, parameters.correlation_window_size);
  matcher->setPreFilterType(cv::StereoBM::PREFILTER_XSOBEL);
  matcher->setPreFilterSize(parameters.prefilter_size);
  matcher->setPreFilterCap(parameters.prefilter_cap);
  matcher->setMinDisparity(parameters.min_disparity);
  matcher->setUniquenessRatio(parameters.uniqueness_ratio);
  matcher->setTextureThreshold(parameters.texture_threshold);
  matcher->setSpeckleWindowSize(parameters.speckle_size);
  matcher->setSpeckleRange(parameters.speckle_range);
  cv::Mat1s disparity_16th_px;
  matcher->compute(left, right, disparity_16th_px);

  StereoResult result;
  result.pairs = 1;
  result.pixels = left.total();
  for (int v = 0; v < left.rows; ++v) {
    for (int u = 0; u < left.cols; ++u) {
      const double d = disparity_16th_px(v, u) / 16.0;
      if (d < parameters.min_disparity || d <= 0) continue;
      CloudPoint point;
      point.p = rectifier.point(u, v, d);
      point.intensity = static_cast<float>(left(v, u)) / 255.0f;
      point.frame = pair.frame;
      point.column = static_cast<float>(rectifier.raw_left(u, v).x());
      result.cloud.points.push_back(point);
    }
  }
  result.rejected.push_back({"no disparity", result.pixels - result.cloud.points.size()});
  if (result.cloud.points.empty()) result.reason = "block matching found no disparity";
  return result;
}

}  // namespace tankrig
