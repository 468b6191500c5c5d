// The paper's marker: dots in a flat layout, measured by ViSP and told apart by where they lie.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Errors: InputError if dots lie in a line, or the layout looks much the same with its dots exchanged.
void check_layout(const std::vector<Vector3d>& layout);

/// Centres of the dots in the layout's order; empty if the picture does not show all of them, or they cannot be told apart.
/// Dark dots on bright ground or bright ones on dark; none may touch another.
std::vector<Vector2d> find_dots(const cv::Mat& grey, const std::vector<Vector3d>& layout);

}  // namespace tankrig
