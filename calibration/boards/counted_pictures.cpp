#include "calibration/boards/counted_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kWidestEdge_px = 6;      // a blur of 2.4 px: a corner is then known to a tenth of a pixel at best
constexpr double kSamePlace = 0.01;       // of the image's width: a tilt of 20 degrees moves corners farther
constexpr std::size_t kFewestCommon = 4;  // corners of two pictures that tell whether the board is held alike
constexpr std::size_t kFewestLines = 3;

bool spreads(const FoundBoard& board, const BoardTarget& target) {
  std::set<int> rows, columns;
  for (const int id : board.ids) rows.insert(id / target.columns), columns.insert(id % target.columns);
  return rows.size() >= kFewestLines && columns.size() >= kFewestLines;
}

/// The longest way of a corner that both show; infinite if these are too few.
double longest_way_px(const FoundBoard& a, const FoundBoard& b) {
  double longest = 0;
  std::size_t common = 0;
  for (std::size_t i = 0, k = 0; i < a.ids.size() && k < b.ids.size();) {
    if (a.ids[i] == b.ids[k]) longest = std::max(longest, (a.pixels[i] - b.pixels[k]).norm()), ++common;
    a.ids[i] <= b.ids[k] ? ++i : ++k;
  }
  return common < kFewestCommon ? HUGE_VAL : longest;
}

}  // namespace

double edge_width_px(const cv::Mat& grey, const FoundBoard& board) {
  const int reach = std::clamp(static_cast<int>(std::lround(0.3 * board.smallest_spacing)), 3, 12);
  std::vector<double> widths;
  for (const Vector2d& pixel : board.pixels) {
    const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
    const cv::Rect around =
        cv::Rect(at.x - reach, at.y - reach, 2 * reach + 1, 2 * reach + 1) & cv::Rect(0, 0, grey.cols, grey.rows);
    const cv::Mat patch = grey(around);
    cv::Mat along_x, along_y, slope;
    cv::Sobel(patch, along_x, CV_32F, 1, 0, 3, 1.0 / 8);
    cv::Sobel(patch, along_y, CV_32F, 0, 1, 3, 1.0 / 8);
    cv::magnitude(along_x, along_y, slope);
    double darkest = 0, brightest = 0, steepest = 0;
    cv::minMaxLoc(patch, &darkest, &brightest);
    cv::minMaxLoc(slope, nullptr, &steepest);
    widths.push_back(steepest > 0 ? (brightest - darkest) / steepest : HUGE_VAL);
  }
  return upper_median(widths);
}

std::string why_not_sharp(const cv::Mat& grey, const FoundBoard& board) {
  const double width = edge_width_px(grey, board);
  if (width <= kWidestEdge_px) return {};
  return fmt::format("found edges {:.1f} px wide, expected {:.0f} px and less: not sharp, hold it still, or focus",
                     width, kWidestEdge_px);
}

BoardSearch find_clear_board(const cv::Mat& grey, const BoardTarget& target) {
  BoardSearch search = find_board(grey, target);
  if (!search.board) return search;
  if (!spreads(*search.board, target)) return {{}, "found corners along a line or two, expected more of the board"};
  if (std::string blurred = why_not_sharp(grey, *search.board); !blurred.empty()) return {{}, std::move(blurred)};
  return search;
}

std::string CountedPictures::add(const FoundBoard& board) {
  for (const FoundBoard& other : counted_)
    if (longest_way_px(board, other) < kSamePlace * width_) return "the board is held as in a picture before, move it";
  for (const Vector2d& p : board.pixels) {
    const auto cell = [](double at, int size, int cells) {
      return std::clamp(static_cast<int>(at * cells / size), 0, cells - 1);
    };
    cells_[static_cast<std::size_t>(cell(p.y(), height_, kRows) * kColumns + cell(p.x(), width_, kColumns))] = true;
  }
  counted_.push_back(board);
  return {};
}

double CountedPictures::covered() const {
  return static_cast<double>(std::count(cells_.begin(), cells_.end(), true)) / static_cast<double>(cells_.size());
}

}  // namespace tankrig
