// Rectification: both eyes turned until a point of the scene lies on the same row of both images.
#pragma once

#include <opencv2/core.hpp>

#include "core/camera_file.hpp"
#include "reconstruction/stereo/stereo_pair.hpp"

namespace tankrig {

/// Eyes behind flat ports have no single viewpoint. Their images are rectified as the nearest pinholes would see a
/// plane at kPortDepth, along the rectified axis. Rows then agree there, and nearly at other depths; points come from the
/// lines of sight through the ports.
/// Frames: pixels (u, v) are those of the rectified left image; points come back in the left camera's frame c.
/// Units: disparity = u_left - u_right [px] >= 0, depth = focal_px * baseline / disparity, along the rectified z axis
/// [m].
/// Errors: InputError if the cameras differ in size or do not stand side by side (left, right). Source:
/// cv::stereoRectify (Bouguet's split of the rotation), zero disparity at infinity.
class Rectifier {
 public:
  explicit Rectifier(const StereoCalibration& calibration);

  /// Bilinear, 8-bit, black outside: the common rectification of ROS's image_proc.
  /// Errors: InputError on another size or type.
  cv::Mat1b left(const cv::Mat& image) const;
  cv::Mat1b right(const cv::Mat& image) const;

  /// Bicubic at unrounded coordinates, for matching finer than 1/32 px; NaN outside the raw image.
  cv::Mat1f left_fine(const cv::Mat1f& grey) const;
  cv::Mat1f right_fine(const cv::Mat1f& grey) const;

  cv::Size size() const { return size_; }
  double baseline() const { return baseline_; }

  /// Behind ports, those in the middle of the image.
  double depth(double disparity) const;
  double disparity(double depth) const;
  /// The scene point seen at rectified pixel (u, v) with this disparity, frame c.
  Vector3d point(double u, double v, double disparity) const;
  /// Pixel of the rectified left image, and disparity, of a point in c: {u, v, disparity}.
  Vector3d project(const Vector3d& p) const;
  /// Of each eye, as camera_info has it; the right one's P carries the baseline.
  const Rectification& left_rectification() const { return left_rectification_; }
  const Rectification& right_rectification() const { return right_rectification_; }
  /// Where the rectified left pixel lies in the raw left image [px].
  Vector2d raw_left(int u, int v) const { return {left_x_(v, u), left_y_(v, u)}; }

 private:
  static constexpr double kPortDepth = 1;  ///< [m]
  /// Where, before the rectified eye, a rectified pixel lies at kPortDepth; an eye's own frame.
  Vector3d place(const CameraModel& camera, const Rectification& eye, double u, double v) const;
  /// The line of sight of a rectified pixel.
  ViewingRay sight(const CameraModel& camera, const Rectification& eye, double u, double v) const;
  /// Rectified pixel of a point, in the eye's own frame.
  Vector2d pixel(const CameraModel& camera, const Rectification& eye, const Vector3d& p) const;
  void map(const CameraModel& camera, const Rectification& eye, cv::Mat1f& x, cv::Mat1f& y) const;

  StereoCalibration calibration_;
  bool ports_ = false;
  cv::Size size_;
  double focal_px_ = 0, cx_ = 0, cy_ = 0, baseline_ = 0;
  Eigen::Matrix3d rectified_R_c_ = Eigen::Matrix3d::Identity();
  Rectification left_rectification_, right_rectification_;
  cv::Mat1f left_x_, left_y_, right_x_, right_y_;
};

/// The image as 8-bit grey.
/// Errors: InputError if it is not 8-bit with 1 or 3 channels, or not of `size`.
cv::Mat1b grey_image(const cv::Mat& image, cv::Size size);

}  // namespace tankrig
