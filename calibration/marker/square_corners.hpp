// The corners of a black square on white, where its sides meet.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

/// Each side is a parabola through the edge found along it: a lens bends sides, and blur rounds corners but leaves sides in place.
/// `corners`: four, in order, a pixel or two off at most. A side whose edge is not found keeps its line between them.
void refine_square_corners(const cv::Mat& grey, std::vector<cv::Point2f>& corners);

}  // namespace tankrig
