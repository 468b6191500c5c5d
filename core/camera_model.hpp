// Pinhole camera with Brown-Conrady distortion and unequal focal lengths (OpenCV's model and order), behind a flat port
// where it has one.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "core/flat_port.hpp"
#include "core/frames.hpp"

namespace tankrig {

/// How often a pose is found over again by a solver for pinholes, of what pixels behind a port show at the depths of the
/// pose before (CameraModel::normalized()): each is nearer by the port's distance over the points'.
inline constexpr int kPortRounds = 6;

/// Frames: camera c (z into the scene, x right, y down).
/// Units: pixels. The centre of the top-left pixel is (0, 0); the image covers [-0.5, width - 0.5) x [-0.5, height -
/// 0.5).
/// Source: D. C. Brown 1971; k1, k2, p1, p2, k3 as in OpenCV's calib3d.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  std::optional<FlatPort> port = std::nullopt;

  /// Pixel of the camera-frame point p [m]; nothing if p is not in front of the camera, or not beyond its port (it may
  /// be outside the image).
  std::optional<Vector2d> project(const Vector3d& p) const;

  /// The line of sight of pixel (u, v); behind a port, that in the water.
  ViewingRay sight(double u, double v) const;

  /// Unit direction of sight(u, v).
  Vector3d ray(double u, double v) const { return sight(u, v).direction; }

  /// Undistorted point (x, y) on the plane z = 1 seen at pixel (u, v), by the lens alone, without a port. Inverts the
  /// distortion to 1e-12 by Newton steps.
  Vector2d normalized(double u, double v) const;

  /// Where a pinhole in c's origin would see, on the plane z = 1, what pixel (u, v) shows at `depth` along z. Without a
  /// port this is normalized(u, v), whatever the depth.
  Vector2d normalized(double u, double v, double depth) const;

  /// Whether every pixel has its own ray: false where the distortion folds over within the image.
  bool invertible() const;

  /// Whether every pixel looks through its port, at less than 85 degrees; true without one.
  bool looks_through_port() const;

  bool contains(const Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() >= -0.5 && pixel.y() < height - 0.5;
  }

  cv::Matx33d matrix() const { return {fx, 0, cx, 0, fy, cy, 0, 0, 1}; }
  cv::Mat distortion() const { return (cv::Mat_<double>(1, 5) << k1, k2, p1, p2, k3); }
};

}  // namespace tankrig
