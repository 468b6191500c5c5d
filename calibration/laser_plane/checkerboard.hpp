// A checkerboard in a picture, and where it stands: the surface that a stripe falls on.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "calibration/laser_plane/stripe_points.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

/// Inner corners and the side of a square [m].
struct Checkerboard {
  int columns = 9, rows = 6;
  double square = 0.03;
};

/// "9x6" and a side.
/// Errors: InputError for what is no pattern of at least 3x3.
Checkerboard checkerboard_of(const std::string& pattern, double square);

/// Frames: t has its origin at a corner inner corner of the board, x along a row, y along a column. Which corner is not told: a
/// board looks the same upside down.
struct CheckerboardView {
  Transform cMt = Transform::Identity();
  double rms = 0;                 ///< reprojection, per corner [px]
  std::vector<Vector3d> points;   ///< the corners in t
  std::vector<Vector2d> corners;  ///< where they are seen [px]
};

/// OpenCV's sector-based detector, then the pose of least reprojection error. Nothing if not all corners are seen.
/// Errors: InputError if `picture` is not of the camera's size.
std::optional<CheckerboardView> find_checkerboard(const cv::Mat& picture, const Checkerboard& board,
                                                  const CameraModel& camera);

/// The board with its outermost squares, a tenth of a square from their edge.
BoardArea area_of(const Checkerboard& board);

}  // namespace tankrig
