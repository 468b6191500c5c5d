// The solvers' problems from what `calibrate all` recorded.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/calibrate/sheet_data.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "calibration/hand_eye/hand_eye.hpp"
#include "calibration/stereo/stereo.hpp"
#include "rig/config/rig_config.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// A camera's picture and the target in it.
struct BoardShot {
  std::string file;
  BoardSearch search{{}, "no picture was taken"};
};
/// Every picture of a camera.
std::vector<BoardShot> board_shots(const Session& session, const std::string& camera, const BoardTarget& target,
                                   Progress& progress);

/// Every fifth is held back.
bool held_back(std::size_t picture);

/// One view per posture in which the camera sees the marker, at the joints recorded.
std::vector<HandEyeView> marker_views(const Session& session, const RigCamera& camera, const GripperMarker& marker,
                                      Progress& progress);

/// The paper's way: the stripe placed by both eyes, pair by pair, in the left one. `late`: by how much the eyes' stamps are late
/// against those that the session took for right.
std::vector<SheetView> stereo_views(const OpenedSession& opened, const RigCamera& left, const RigCamera& right,
                                    Duration late, Progress& progress);

}  // namespace tankrig::app
