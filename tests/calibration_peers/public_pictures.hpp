// The chessboard pictures that Debian's opencv-doc ships: left and right 01 to 14, without 10; squares of 30 mm.
#pragma once

#include <fmt/core.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "calibration/boards/find_board.hpp"
#include "tests/board_calibration/generated_boards.hpp"

namespace tankrig {

inline constexpr const char* kPublicPictures = "/usr/share/doc/opencv-doc/examples/data";
inline constexpr const char* kNoPublicPictures = "Debian's opencv-doc is not installed";

inline bool public_pictures_here() { return std::filesystem::exists(std::string(kPublicPictures) + "/left01.jpg"); }

inline std::vector<int> public_numbers() { return {1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14}; }

inline FoundBoard public_board(const char* side, int number) {
  const std::string file = fmt::format("{}/{}{:02}.jpg", kPublicPictures, side, number);
  const BoardSearch search = find_board(cv::imread(file, cv::IMREAD_GRAYSCALE), checkerboard());
  if (!search.board) throw std::runtime_error(file + ": " + search.refused);
  return *search.board;
}

}  // namespace tankrig
