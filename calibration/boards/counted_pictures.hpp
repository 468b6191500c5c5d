// Which pictures of a target count: it is found, sharp, and held as in none that counts already.
#pragma once

#include <string>
#include <vector>

#include "calibration/boards/find_board.hpp"

namespace tankrig {

/// How wide the target's edges are in the picture: about 2 px where it is sharp.
double edge_width_px(const cv::Mat& grey, const FoundBoard& board);

/// Empty: it is sharp. Else how wide its edges are, and what to do.
std::string why_not_sharp(const cv::Mat& grey, const FoundBoard& board);

/// find_board(), and refuses what no pose or lens can be told from: corners along a line or two, and blurred ones.
/// Threads: any.
/// Errors: as find_board().
BoardSearch find_clear_board(const cv::Mat& grey, const BoardTarget& target);

/// Those of one camera, in their order.
class CountedPictures {
 public:
  CountedPictures(int width, int height) : width_(width), height_(height) {}

  /// Empty: it counts from now on. Else why not.
  std::string add(const FoundBoard& board);

  std::size_t count() const { return counted_.size(); }
  /// Share of the image's cells that have a corner.
  double covered() const;

 private:
  static constexpr int kColumns = 8, kRows = 6;

  int width_, height_;
  std::vector<FoundBoard> counted_;
  std::vector<bool> cells_ = std::vector<bool>(kColumns * kRows);
};

}  // namespace tankrig
