// Rectification maps from OpenCV, and a bicubic resampler that does not round its coordinates.

#include "reconstruction/stereo/rectifier.hpp"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

std::string text(cv::Size size) { return fmt::format("{} x {}", size.width, size.height); }

/// Weights of the four samples at -1, 0, 1, 2 for a position t in [0, 1) (Keys 1981, a = -1/2).
void cubic_weights(float t, float w[4]) {
  const float t2 = t * t;
  const float t3 = t2 * t;
  w[0] = 0.5f * (-t3 + 2 * t2 - t);
  w[1] = 0.5f * (3 * t3 - 5 * t2 + 2);
  w[2] = 0.5f * (-3 * t3 + 4 * t2 + t);
  w[3] = 0.5f * (t3 - t2);
}

cv::Mat1f resample(const cv::Mat1f& image, const cv::Mat1f& map_x, const cv::Mat1f& map_y) {
  cv::Mat1f out(map_x.size());
  tbb::parallel_for(0, out.rows, [&](int v) {
    for (int u = 0; u < out.cols; ++u) {
      const float x = map_x(v, u);
      const float y = map_y(v, u);
      const int x0 = static_cast<int>(std::floor(x));
      const int y0 = static_cast<int>(std::floor(y));
      if (x0 < 1 || y0 < 1 || x0 + 2 >= image.cols || y0 + 2 >= image.rows) {
        out(v, u) = std::numeric_limits<float>::quiet_NaN();
        continue;
      }
      float wx[4], wy[4];
      cubic_weights(x - static_cast<float>(x0), wx);
      cubic_weights(y - static_cast<float>(y0), wy);
      float sum = 0;
      for (int j = 0; j < 4; ++j) {
        const float* row = image[y0 - 1 + j] + x0 - 1;
        sum += wy[j] * (wx[0] * row[0] + wx[1] * row[1] + wx[2] * row[2] + wx[3] * row[3]);
      }
      out(v, u) = sum;
    }
  });
  return out;
}

cv::Mat1b remapped(const cv::Mat1b& grey, const cv::Mat1f& map_x, const cv::Mat1f& map_y) {
  cv::Mat out;
  cv::remap(grey, out, map_x, map_y, cv::INTER_LINEAR);
  return out;
}

}  // namespace

cv::Mat1b grey_image(const cv::Mat& image, cv::Size size) {
  if (image.size() != size)
    throw InputError("stereo: image of " + text(image.size()) + " pixels, expected " + text(size) + " as calibrated");
  if (image.type() == CV_8UC1) return image;
  if (image.type() != CV_8UC3)
    throw InputError("stereo: image of type " + cv::typeToString(image.type()) + ", expected 8-bit grey or BGR");
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

Rectifier::Rectifier(const StereoCalibration& calibration) : size_(calibration.left.width, calibration.left.height) {
  const CameraModel& left = calibration.left;
  const CameraModel& right = calibration.right;
  if (size_.area() <= 0 || right.width != left.width || right.height != left.height)
    throw InputError(fmt::format("stereo: left camera {}, right camera {}, expected two equal sizes", text(size_),
                                 text({right.width, right.height})));
  const Vector3d t = calibration.rMc.translation();
  if (!(t.x() < 0) || std::abs(t.x()) < std::hypot(t.y(), t.z()))
    throw InputError(fmt::format(
        "stereo: rMc translation ({:f}, {:f}, {:f}) m, expected the right camera beside the left one, x < 0", t.x(),
        t.y(), t.z()));

  cv::Matx33d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = calibration.rMc.linear()(i, j);
  cv::Mat R1, R2, P1, P2, Q;
  cv::stereoRectify(left.matrix(), left.distortion(), right.matrix(), right.distortion(), size_, R,
                    cv::Vec3d(t.x(), t.y(), t.z()), R1, R2, P1, P2, Q, cv::CALIB_ZERO_DISPARITY, -1, size_);
  cv::initUndistortRectifyMap(left.matrix(), left.distortion(), R1, P1, size_, CV_32FC1, left_x_, left_y_);
  cv::initUndistortRectifyMap(right.matrix(), right.distortion(), R2, P2, size_, CV_32FC1, right_x_, right_y_);

  left_rectification_ = {cv::Matx33d(R1), cv::Matx34d(P1)};
  right_rectification_ = {cv::Matx33d(R2), cv::Matx34d(P2)};
  focal_px_ = P1.at<double>(0, 0);
  cx_ = P1.at<double>(0, 2);
  cy_ = P1.at<double>(1, 2);
  baseline_ = -P2.at<double>(0, 3) / P2.at<double>(0, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rectified_R_c_(i, j) = R1.at<double>(i, j);
}

cv::Mat1b Rectifier::left(const cv::Mat& image) const { return remapped(grey_image(image, size_), left_x_, left_y_); }
cv::Mat1b Rectifier::right(const cv::Mat& image) const {
  return remapped(grey_image(image, size_), right_x_, right_y_);
}
cv::Mat1f Rectifier::left_fine(const cv::Mat1f& grey) const { return resample(grey, left_x_, left_y_); }
cv::Mat1f Rectifier::right_fine(const cv::Mat1f& grey) const { return resample(grey, right_x_, right_y_); }

Vector3d Rectifier::point(double u, double v, double disparity) const {
  const double z = depth(disparity);
  return rectified_R_c_.transpose() * Vector3d((u - cx_) * z / focal_px_, (v - cy_) * z / focal_px_, z);
}

Vector3d Rectifier::project(const Vector3d& p) const {
  const Vector3d q = rectified_R_c_ * p;
  return {cx_ + focal_px_ * q.x() / q.z(), cy_ + focal_px_ * q.y() / q.z(), disparity(q.z())};
}

}  // namespace tankrig
