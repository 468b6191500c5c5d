// Hand-eye closed forms of ViSP and OpenCV, for a marker in the gripper and a camera that stands still.
#pragma once

#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

struct ClosedForm {
  std::string name;     ///< "ViSP", "Tsai", ...
  std::string failure;  ///< what went wrong; empty: an answer
  Transform cMb = Transform::Identity(), eMg = Transform::Identity();
};

/// All of them on the same poses, in a fixed order. Those that solve for the camera alone have eMg as the mean over the views.
/// Threads: one at a time; ViSP's prints are swallowed.
std::vector<ClosedForm> closed_forms(const std::vector<Transform>& cMg, const std::vector<Transform>& bMe);

/// The rotation nearest to the sum of rotations, and the mean of translations.
Transform mean_of(const std::vector<Transform>& transforms);

}  // namespace tankrig
