// Whether seen and commanded poses belong together, before anything is solved: the angle between two views is the same in the
// camera and in the arm's base, wherever the camera stands and however the marker is held.
#pragma once

#include <optional>
#include <vector>

#include "calibration/hand_eye/hand_eye.hpp"

namespace tankrig {

/// bMe of a view, by the arm as it is.
Transform arm_pose(const ArmModel& arm, const HandEyeView& view);

/// Picks for every view that of its two poses that agrees best with the others'; returns the views whose second it was. `cMg` of the
/// views is what was picked afterwards, `cMg_flipped` the other.
std::vector<std::size_t> pick_poses(const ArmModel& arm, std::vector<HandEyeView>& views);

/// By how many places the list of joints is shifted against the list of pictures; 0: not, or not to be told.
int shift_of_joints(const ArmModel& arm, const std::vector<HandEyeView>& views);

}  // namespace tankrig
