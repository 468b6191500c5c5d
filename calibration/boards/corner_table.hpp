// corners.csv: a target's corners in pictures, as another program found them.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "calibration/boards/find_board.hpp"

namespace tankrig {

/// Pictures of one camera.
struct CornerTable {
  struct Picture {
    std::string name;
    BoardSearch search;
  };
  cv::Size size;
  std::vector<Picture> pictures;  ///< in the order in which the file names them first
};

/// Header picture,width_px,height_px,corner,x_px,y_px; a line a corner. `corner` counts BoardTarget::points(). A picture's board is
/// refused if it has too few corners, or if they go round the other way: then they are numbered, or the picture is, mirrored.
/// Errors: InputError with file and line: a number out of range, a corner twice, another size than the first picture's.
CornerTable read_corner_table(const std::filesystem::path& file, const BoardTarget& target);

}  // namespace tankrig
