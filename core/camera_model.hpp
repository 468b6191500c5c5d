// Pinhole camera with Brown-Conrady distortion and unequal focal lengths (OpenCV's model and order).
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Frames: camera c (z into the scene, x right, y down).
/// Units: pixels. The centre of the top-left pixel is (0, 0); the image covers [-0.5, width - 0.5) x [-0.5, height -
/// 0.5). Source: D. C. Brown 1971; k1, k2, p1, p2, k3 as in OpenCV's calib3d.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  /// Pixel of the camera-frame point p [m]; nothing if p is not in front of the camera (it may be outside the image).
  std::optional<Vector2d> project(const Vector3d& p) const;

  /// Undistorted point (x, y) on the plane z = 1 seen at pixel (u, v). Inverts the distortion to 1e-12 by Newton steps.
  Vector2d normalized(double u, double v) const;

  /// Unit direction of the ray of pixel (u, v), camera frame.
  Vector3d ray(double u, double v) const;

  /// Whether every pixel has its own ray: false where the distortion folds over within the image.
  bool invertible() const;

  bool contains(const Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() >= -0.5 && pixel.y() < height - 0.5;
  }

  cv::Matx33d matrix() const { return {fx, 0, cx, 0, fy, cy, 0, 0, 1}; }
  cv::Mat distortion() const { return (cv::Mat_<double>(1, 5) << k1, k2, p1, p2, k3); }
};

/// Unit rays of every pixel, row-major, width * height, camera frame.
std::vector<Vector3d> pixel_rays(const CameraModel& camera);

/// Reads an OpenCV calibration (camera_matrix, distortion_coefficients) or a ROS camera_info YAML file.
/// Errors: InputError with file, field and what was expected.
CameraModel read_camera_file(const std::filesystem::path& file);

/// How an image is turned and projected to become rectified, as ROS's camera_info has it: a camera-frame point p falls
/// on the rectified pixel P * (R p, 1).
/// Units: pixels; the last column of P is metres times pixels.
struct Rectification {
  cv::Matx33d R = cv::Matx33d::eye();
  cv::Matx34d P = cv::Matx34d::zeros();
};

/// That of a camera by itself: distortion removed, nothing turned.
Rectification rectification_of(const CameraModel& camera);

/// Writes ROS camera_info YAML, which read_camera_file reads back exactly.
void write_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name);
void write_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name,
                       const Rectification& rectification);

}  // namespace tankrig
