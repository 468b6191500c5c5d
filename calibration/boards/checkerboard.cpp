// A checkerboard found in a picture.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "calibration/boards/board_grid.hpp"

namespace tankrig {
namespace {

/// The squares of a board in a picture: their brightness, also beyond the corners that were found.
class Squares {
 public:
  Squares(const cv::Mat& grey, const BoardGrid& grid, const cv::Matx33d& H) : grey_(grey), grid_(grid), H_(H) {
    double even = 0, odd = 0;
    int evens = 0, odds = 0;
    for (int row = 0; row + 1 < grid.rows; ++row)
      for (int column = 0; column + 1 < grid.columns; ++column)
        if (const auto value = brightness(column + 0.5, row + 0.5)) {
          ((row + column) % 2 == 0 ? even : odd) += *value;
          ++((row + column) % 2 == 0 ? evens : odds);
        }
    even_ = evens > 0 ? even / evens : 0, odd_ = odds > 0 ? odd / odds : 0;
  }

  /// The square between the first four corners is a black one.
  bool first_is_black() const { return even_ < odd_; }
  double contrast() const { return std::abs(even_ - odd_); }

  enum Side { kTop, kBottom, kLeft, kRight };

  /// Whether the corners go on beyond `side`: black and white squares meet at most of the next ones.
  bool goes_on(Side side) const {
    int tested = 0, corners = 0;
    for (int i = 0; i < along(side); ++i) {
      const auto first = square(side, i - 1, 0), second = square(side, i, 0), third = square(side, i - 1, 1),
                 fourth = square(side, i, 1);
      if (!first || !second || !third || !fourth) continue;
      ++tested;
      corners += *first * *second < 0 && *second * *fourth < 0 && *first * *third < 0 ? 1 : 0;
    }
    return tested >= 2 && corners > 0.6 * tested;
  }

  /// Whether the board ends there, in view: one more row of squares, then none.
  bool ends(Side side) const {
    int tested = 0, alternate = 0;
    for (int i = 0; i + 1 < along(side); ++i) {
      const auto here = square(side, i, 0), next = square(side, i + 1, 0), beyond = square(side, i, 1);
      if (!here || !next || !beyond) continue;
      ++tested;
      alternate += *here * *next < 0 ? 1 : 0;
    }
    return tested >= 2 && alternate > 0.6 * tested && !goes_on(side);
  }

 private:
  int along(Side side) const { return side == kTop || side == kBottom ? grid_.columns : grid_.rows; }

  /// Square `i` along a side, `out` rows of squares beyond the first one outside: above 0 bright, below 0 dark; near 0
  /// neither. Nothing out of the picture.
  std::optional<double> square(Side side, int i, int out) const {
    const double along_side = i + 0.5, before = -0.5 - out;
    const auto value = side == kTop      ? brightness(along_side, before)
                       : side == kBottom ? brightness(along_side, grid_.rows - 1 - before)
                       : side == kLeft   ? brightness(before, along_side)
                                         : brightness(grid_.columns - 1 - before, along_side);
    if (!value) return std::nullopt;
    const double from_middle = (*value - (even_ + odd_) / 2) / std::max(contrast(), 1.0);
    return std::abs(from_middle) < 0.15 ? 0 : from_middle;
  }

  std::optional<double> brightness(double column, double row) const {
    const cv::Point2d p = place(H_, column, row);
    if (!(p.x >= 1 && p.y >= 1 && p.x < grey_.cols - 2 && p.y < grey_.rows - 2)) return std::nullopt;
    const cv::Rect box(static_cast<int>(std::lround(p.x)) - 1, static_cast<int>(std::lround(p.y)) - 1, 3, 3);
    return cv::mean(grey_(box & cv::Rect({}, grey_.size())))[0];
  }

  const cv::Mat& grey_;
  const BoardGrid& grid_;
  cv::Matx33d H_;
  double even_ = 0, odd_ = 0;
};

constexpr Squares::Side kSides[] = {Squares::kTop, Squares::kBottom, Squares::kLeft, Squares::kRight};

std::string expected(const BoardTarget& target) {
  return fmt::format("expected {} x {} corners", target.columns, target.rows);
}

/// No board of the right size: what there is instead, by a search for a board of any size.
std::string what_is_there(const cv::Mat& grey, const BoardTarget& target) {
  BoardGrid grid;
  cv::Mat corners, meta;
  // Its own pictures: 8-bit, and not smaller than a few squares.
  const bool any =
      std::min(grey.rows, grey.cols) >= 50 &&
      cv::findChessboardCornersSB(grey, {3, 3}, corners, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER, meta);
  if (!any) return "found no checkerboard, " + expected(target);
  grid.columns = meta.cols, grid.rows = meta.rows;
  grid.points.assign(corners.begin<cv::Point2f>(), corners.end<cv::Point2f>());
  if (grid.points.size() != static_cast<std::size_t>(grid.columns * grid.rows))
    return "found no whole checkerboard, " + expected(target);
  const auto H = grid.homography();
  const auto [less, more] = std::minmax(grid.columns, grid.rows);
  const auto [target_less, target_more] = std::minmax(target.columns, target.rows);
  const bool smaller = less <= target_less && more <= target_more;
  const std::string size = fmt::format("{} x {} corners", std::max(more, less), std::min(more, less));
  if (!smaller) return "found a board of " + size + ", " + expected(target);
  const Squares squares(grey, grid, H.value_or(cv::Matx33d::eye()));
  const bool whole =
      H && std::all_of(std::begin(kSides), std::end(kSides), [&](auto side) { return squares.ends(side); });
  if (whole && !(less == target_less && more == target_more))
    return "found a board of " + size + ", " + expected(target);
  return fmt::format("found a part of a board, {}, {}: the rest is out of the picture, covered or not sharp", size,
                     expected(target));
}

}  // namespace

BoardSearch find_checkerboard(const cv::Mat& grey, const BoardTarget& target) {
  BoardGrid grid{target.columns, target.rows, {}};
  // Squares of either colour may come first; the pattern's first corner is found by their colours below.
  if (!cv::findChessboardCorners(grey, {target.columns, target.rows}, grid.points,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return {{}, what_is_there(grey, target)};
  grid.face_front();
  const auto H = grid.homography();
  if (!H) return {{}, "found corners that lie on no plane, " + expected(target)};
  const Squares squares(grey, grid, *H);
  for (const Squares::Side side : kSides)
    if (squares.goes_on(side))
      return {{},
              fmt::format("found a board that goes on beyond {} x {} corners, {}", target.columns, target.rows,
                          expected(target))};
  if ((target.columns + target.rows) % 2 != 0 && !squares.first_is_black()) grid.turn_half();
  refine_corners(grey, spacings(grid), grid.points);
  return found(grid);
}

}  // namespace tankrig
