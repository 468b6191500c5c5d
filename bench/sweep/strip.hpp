// Camera views side by side, each with its condition: the paper's Figures 6 and 7.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

namespace tankrig {

/// `views`: a caption and its 8-bit picture each, of one size; `columns` in a row, each `width` pixels wide. 8-bit BGR.
cv::Mat view_strip(const std::vector<std::pair<std::string, cv::Mat>>& views, int columns, int width);

}  // namespace tankrig
