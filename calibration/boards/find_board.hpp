// A calibration target found in a picture, or why it is not.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/boards/board_target.hpp"

namespace tankrig {

/// Corners or dots in the picture. Their order is that of a target seen from its front, the right way up where the
/// target tells it (BoardTarget::turns()), however the target is held.
/// Units: pixels.
struct FoundBoard {
  std::vector<int> ids;  ///< numbers in BoardTarget::points(), rising; all of them, but for ChArUco
  std::vector<Vector2d> pixels;
  double smallest_spacing = 0;  ///< between neighbours
};

struct BoardSearch {
  std::optional<FoundBoard> board;
  std::string refused;  ///< why there is none: half seen, of another size, mirrored, too small, none at all
};

/// Corners are refined in a window of a quarter of the projected square's side, each in its own.
/// A checkerboard and dots look the same in a mirror; only a ChArUco board tells.
/// Threads: any.
/// Errors: InputError if `grey` is not 8-bit grey.
BoardSearch find_board(const cv::Mat& grey, const BoardTarget& target);

}  // namespace tankrig
