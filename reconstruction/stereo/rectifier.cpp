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
#include "core/ray_meeting.hpp"

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

/// A pinhole that sees about what the camera sees through its port, to choose the rectified images' size by.
CameraModel in_water(const CameraModel& camera) {
  if (!camera.port) return camera;
  const double longer = camera.port->water / camera.port->air;
  return {camera.width, camera.height, longer * camera.fx, longer * camera.fy, camera.cx, camera.cy};
}

/// Where its lines of sight near the port's normal meet: a pinhole there comes nearest to the camera.
Vector3d viewpoint(const CameraModel& camera) {
  if (!camera.port) return Vector3d::Zero();
  const FlatPort& port = *camera.port;
  return (port.distance * (1 - port.water / port.air) + port.thickness * (1 - port.water / port.glass)) * port.normal;
}

/// The line of sight that passes p.
ViewingRay sight_to(const CameraModel& camera, const Vector3d& p) {
  Vector3d seen = p;
  if (!camera.port || !seen_through(*camera.port, camera.port->distance, camera.port->normal, p, seen))
    return {Vector3d::Zero(), p.normalized()};
  return camera.port->beyond(seen.normalized());
}

Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(const Rectification& eye) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(eye.R.val);
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

Rectifier::Rectifier(const StereoCalibration& calibration)
    : calibration_(calibration),
      ports_(calibration.left.port || calibration.right.port),
      size_(calibration.left.width, calibration.left.height) {
  const CameraModel left = in_water(calibration.left), right = in_water(calibration.right);
  if (size_.area() <= 0 || right.width != left.width || right.height != left.height)
    throw InputError(fmt::format("stereo: left camera {}, right camera {}, expected two equal sizes", text(size_),
                                 text({right.width, right.height})));
  const Vector3d t = calibration.rMc * viewpoint(calibration.left) - viewpoint(calibration.right);
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
  left_rectification_ = {cv::Matx33d(R1), cv::Matx34d(P1)};
  right_rectification_ = {cv::Matx33d(R2), cv::Matx34d(P2)};
  focal_px_ = P1.at<double>(0, 0);
  cx_ = P1.at<double>(0, 2);
  cy_ = P1.at<double>(1, 2);
  baseline_ = -P2.at<double>(0, 3) / P2.at<double>(0, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rectified_R_c_(i, j) = R1.at<double>(i, j);
  if (ports_) {
    map(calibration.left, left_rectification_, left_x_, left_y_);
    map(calibration.right, right_rectification_, right_x_, right_y_);
  } else {
    cv::initUndistortRectifyMap(left.matrix(), left.distortion(), R1, P1, size_, CV_32FC1, left_x_, left_y_);
    cv::initUndistortRectifyMap(right.matrix(), right.distortion(), R2, P2, size_, CV_32FC1, right_x_, right_y_);
  }
}

Vector3d Rectifier::place(const CameraModel& camera, const Rectification& eye, double u, double v) const {
  return viewpoint(camera) +
         kPortDepth * turn(eye).transpose() * Vector3d((u - cx_) / focal_px_, (v - cy_) / focal_px_, 1);
}

ViewingRay Rectifier::sight(const CameraModel& camera, const Rectification& eye, double u, double v) const {
  return sight_to(camera, place(camera, eye, u, v));
}

Vector2d Rectifier::pixel(const CameraModel& camera, const Rectification& eye, const Vector3d& p) const {
  const ViewingRay ray = sight_to(camera, p);
  const Vector3d from = turn(eye) * (ray.origin - viewpoint(camera)), along = turn(eye) * ray.direction;
  const Vector3d q = from + (kPortDepth - from.z()) / along.z() * along;
  return {cx_ + focal_px_ * q.x() / q.z(), cy_ + focal_px_ * q.y() / q.z()};
}

void Rectifier::map(const CameraModel& camera, const Rectification& eye, cv::Mat1f& x, cv::Mat1f& y) const {
  x.create(size_), y.create(size_);
  for (int v = 0; v < size_.height; ++v)
    for (int u = 0; u < size_.width; ++u) {
      const Vector2d at = camera.project(place(camera, eye, u, v)).value_or(Vector2d(-1, -1));
      x(v, u) = static_cast<float>(at.x()), y(v, u) = static_cast<float>(at.y());
    }
}

cv::Mat1b Rectifier::left(const cv::Mat& image) const { return remapped(grey_image(image, size_), left_x_, left_y_); }
cv::Mat1b Rectifier::right(const cv::Mat& image) const {
  return remapped(grey_image(image, size_), right_x_, right_y_);
}
cv::Mat1f Rectifier::left_fine(const cv::Mat1f& grey) const { return resample(grey, left_x_, left_y_); }
cv::Mat1f Rectifier::right_fine(const cv::Mat1f& grey) const { return resample(grey, right_x_, right_y_); }

double Rectifier::depth(double disparity) const {
  if (ports_) return (rectified_R_c_ * point(cx_, cy_, disparity)).z();
  return focal_px_ * baseline_ / disparity;
}

double Rectifier::disparity(double depth) const {
  if (ports_) return project(rectified_R_c_.transpose() * Vector3d(0, 0, depth)).z();
  return focal_px_ * baseline_ / depth;
}

Vector3d Rectifier::point(double u, double v, double disparity) const {
  if (ports_)
    return meeting(sight(calibration_.left, left_rectification_, u, v),
                   calibration_.rMc.inverse() * sight(calibration_.right, right_rectification_, u - disparity, v));
  const double z = depth(disparity);
  return rectified_R_c_.transpose() * Vector3d((u - cx_) * z / focal_px_, (v - cy_) * z / focal_px_, z);
}

Vector3d Rectifier::project(const Vector3d& p) const {
  if (ports_) {
    const Vector2d left = pixel(calibration_.left, left_rectification_, p);
    return {left.x(), left.y(), left.x() - pixel(calibration_.right, right_rectification_, calibration_.rMc * p).x()};
  }
  const Vector3d q = rectified_R_c_ * p;
  return {cx_ + focal_px_ * q.x() / q.z(), cy_ + focal_px_ * q.y() / q.z(), disparity(q.z())};
}

}  // namespace tankrig
