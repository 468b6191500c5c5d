// Pinhole camera with Brown-Conrady distortion and unequal focal lengths (OpenCV's model and order).
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "core/frames.hpp"

namespace tankrig {

/// Frames: camera c (z into the scene, x right, y down).
/// Units: pixels. The centre of the top-left pixel is (0, 0); the image covers [-0.5, width - 0.5) x [-0.5, height -
/// 0.5).
/// Source: D. C. Brown 1971; k1, k2, p1, p2, k3 as in OpenCV's calib3d.
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

}  // namespace tankrig
