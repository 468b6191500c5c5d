// Block matching as ROS's stereo_image_proc runs it.
#include "reconstruction/stereo/paper_stereo.hpp"

#include <opencv2/calib3d.hpp>

#include "reconstruction/stereo/rectifier.hpp"

namespace tankrig {

PaperStereoParameters paper_stereo_parameters_from(const ConfigNode& node) {
  PaperStereoParameters p;
  p.prefilter_size = node.integer_or("prefilter_size", p.prefilter_size, {5, 255});
  p.prefilter_cap = node.integer_or("prefilter_cap", p.prefilter_cap, {1, 63});
  p.correlation_window_size = node.integer_or("correlation_window_size", p.correlation_window_size, {5, 255});
  p.min_disparity = node.integer_or("min_disparity", p.min_disparity, {-128, 128});
  p.disparity_range = node.integer_or("disparity_range", p.disparity_range, {16, 256});
  p.uniqueness_ratio = node.integer_or("uniqueness_ratio", p.uniqueness_ratio, {0, 100});
  p.texture_threshold = node.integer_or("texture_threshold", p.texture_threshold, {0, 10000});
  p.speckle_size = node.integer_or("speckle_size", p.speckle_size, {0, 1000});
  p.speckle_range = node.integer_or("speckle_range", p.speckle_range, {0, 31});
  if (p.prefilter_size % 2 == 0) node.fail("prefilter_size", "expected an odd number");
  if (p.correlation_window_size % 2 == 0) node.fail("correlation_window_size", "expected an odd number");
  if (p.disparity_range % 16 != 0) node.fail("disparity_range", "expected a multiple of 16");
  node.finish();
  return p;
}

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
