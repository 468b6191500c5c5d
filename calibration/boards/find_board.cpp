#include "calibration/boards/find_board.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/boards/board_grid.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kSmallestSpacing = 8;  // px: a window of two on either side

}  // namespace

void BoardGrid::face_front() {
  const cv::Point2f x = at(0, columns - 1) - at(0, 0), y = at(rows - 1, 0) - at(0, 0);
  if (x.cross(y) >= 0) return;
  for (int row = 0; row < rows; ++row)
    std::reverse(points.begin() + row * columns, points.begin() + (row + 1) * columns);
}

std::vector<double> spacings(const BoardGrid& grid) {
  std::vector<double> nearest(grid.points.size(), 1e9);
  const auto pair = [&](int a, int b) {
    const double distance =
        cv::norm(grid.points[static_cast<std::size_t>(a)] - grid.points[static_cast<std::size_t>(b)]);
    for (const int i : {a, b})
      nearest[static_cast<std::size_t>(i)] = std::min(nearest[static_cast<std::size_t>(i)], distance);
  };
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const int here = row * grid.columns + column;
      if (column + 1 < grid.columns) pair(here, here + 1);
      if (row + 1 < grid.rows) pair(here, here + grid.columns);
    }
  return nearest;
}

double BoardGrid::smallest_spacing() const {
  const std::vector<double> all = spacings(*this);
  return *std::min_element(all.begin(), all.end());
}

std::optional<cv::Matx33d> BoardGrid::homography() const {
  std::vector<cv::Point2f> board;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) board.emplace_back(float(column), float(row));
  const cv::Mat H = cv::findHomography(board, points, 0);
  if (H.empty()) return std::nullopt;
  return cv::Matx33d(H);
}

cv::Point2d place(const cv::Matx33d& H, double column, double row) {
  const cv::Vec3d p = H * cv::Vec3d(column, row, 1);
  return {p[0] / p[2], p[1] / p[2]};
}

void refine_corners(const cv::Mat& grey, const std::vector<double>& nearest, std::vector<cv::Point2f>& corners) {
  const cv::TermCriteria until(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 1e-4);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const int window = std::clamp(static_cast<int>(std::lround(0.25 * nearest[i])), 2, 20);
    std::vector<cv::Point2f> one{corners[i]};
    cv::cornerSubPix(grey, one, {window, window}, {-1, -1}, until);
    corners[i] = one.front();
  }
}

BoardSearch found(const BoardGrid& grid) {
  FoundBoard board;
  board.smallest_spacing = grid.smallest_spacing();
  if (board.smallest_spacing < kSmallestSpacing)
    return {{},
            fmt::format("found neighbours {:.1f} px apart, expected {:.0f} px and more: hold the board nearer, or less "
                        "tilted",
                        board.smallest_spacing, kSmallestSpacing)};
  board.ids.resize(grid.points.size());
  std::iota(board.ids.begin(), board.ids.end(), 0);
  for (const cv::Point2f& p : grid.points) board.pixels.emplace_back(p.x, p.y);
  return {std::move(board), {}};
}

BoardSearch find_board(const cv::Mat& grey, const BoardTarget& target) {
  if (grey.type() != CV_8UC1) throw InputError("find_board: found a picture of another type, expected 8-bit grey");
  switch (target.kind) {
    case TargetKind::kCharuco:
      return find_charuco(grey, target);
    case TargetKind::kDots:
    case TargetKind::kAsymmetricDots:
      return find_dots(grey, target);
    case TargetKind::kCheckerboard:
      break;
  }
  return find_checkerboard(grey, target);
}

}  // namespace tankrig
