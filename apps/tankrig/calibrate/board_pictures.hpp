// The pictures of a calibration target that a folder holds, and the target as the command line names it.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "calibration/boards/find_board.hpp"

namespace tankrig::app {

struct TargetOptions {
  std::string kind = "checkerboard", pattern, dictionary = "4x4_50";
  double square_mm = 0, marker_mm = 0;
};
void add_target_options(CLI::App* command, TargetOptions& options);
/// Errors: InputError.
BoardTarget target_of(const TargetOptions& options);

/// A picture as it was searched.
struct SearchedPicture {
  std::string name;
  BoardSearch search;
};

/// Pictures of one camera.
struct SearchedPictures {
  cv::Size size;
  std::vector<SearchedPicture> pictures;
};

/// Looks for the target in every picture; warns of those in which it is not found, and why.
/// Errors: InputError of a picture of another size than the first, or a damaged one.
SearchedPictures search_pictures(const std::vector<std::filesystem::path>& files, const BoardTarget& target,
                                 Progress& progress);

}  // namespace tankrig::app
