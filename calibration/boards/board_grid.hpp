// What the searches for the kinds of targets share: corners in rows and columns, and what lies beyond them.
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "calibration/boards/find_board.hpp"

namespace tankrig {

/// A full grid of points in a picture.
struct BoardGrid {
  int columns = 0, rows = 0;
  std::vector<cv::Point2f> points;  ///< row by row

  const cv::Point2f& at(int row, int column) const { return points[static_cast<std::size_t>(row * columns + column)]; }
  /// The same seen from the front: x to y turns clockwise in the picture.
  void face_front();
  /// The last point becomes the first.
  void turn_half() { std::reverse(points.begin(), points.end()); }
  double smallest_spacing() const;
  /// From (column, row) to the picture, by the plane's homography. Nothing if the points are not such a plane's.
  std::optional<cv::Matx33d> homography() const;
};

/// Where `H` puts (column, row).
cv::Point2d place(const cv::Matx33d& H, double column, double row);

/// The grid as the search's answer. Refused if its points are too close together to be told apart.
BoardSearch found(const BoardGrid& grid);

/// Moves corners of squares to sub-pixel places; each window is a quarter of the way to the nearest neighbour.
void refine_corners(const cv::Mat& grey, const std::vector<double>& spacings, std::vector<cv::Point2f>& corners);

/// The nearest neighbour of each point of the grid [px].
std::vector<double> spacings(const BoardGrid& grid);

BoardSearch find_checkerboard(const cv::Mat& grey, const BoardTarget& target);
BoardSearch find_dots(const cv::Mat& grey, const BoardTarget& target);
BoardSearch find_charuco(const cv::Mat& grey, const BoardTarget& target);

}  // namespace tankrig
