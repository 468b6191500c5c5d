// What a picture of each step is worth: of the board, of the marker in the gripper, of the laser's stripe.
#pragma once

#include <string>

#include "apps/tankrig/calibrate/targets.hpp"
#include "apps/tankrig/calibrate_all/board_count.hpp"
#include "apps/tankrig/calibrate_all/live_pictures.hpp"

namespace tankrig::app {

/// A picture of all cameras at each place. `so_far`: what counts already.
PictureJudge judge_boards(BoardTarget target, BoardCount so_far, std::size_t cameras);

/// The first picture of each posture: it counts if the marker is found, sharp, and seen in no such posture before.
/// Errors: as MarkerFinder's.
PictureJudge judge_marker(const GripperMarker& marker, const std::string& camera);

/// Pictures of a sweep, two degrees of the elbow apart: one counts if enough of the stripe is found on the checkerboard, which must be
/// seen whole while the arm rests, and the elbow stands as in none before. `camera` as far as it is calibrated.
/// Errors: as checkerboard_of().
PictureJudge judge_sheet(const RigCamera& camera, const TargetBoard& board);

}  // namespace tankrig::app
