// The solvers' problems from what `calibrate all` recorded.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/calibrate/sheet_data.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "calibration/hand_eye/hand_eye.hpp"
#include "calibration/joint/joint.hpp"
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

/// The marker in every posture in which the first camera sees it, at the joints recorded, by all of them; named by the first
/// camera's picture.
std::vector<MarkerPosture> seen_postures(const Session& session, const std::vector<const RigCamera*>& cameras,
                                         const GripperMarker& marker, Progress& progress);
/// As the first camera has it. Nothing if its corners allow no pose.
std::optional<HandEyeView> hand_eye_view(const MarkerPosture& posture, const CameraModel& camera);

/// The paper's way: the stripe placed by both eyes, pair by pair, in the left one. `late`: by how much the eyes' stamps are late
/// against those that the session took for right.
std::vector<SheetView> stereo_views(const OpenedSession& opened, const RigCamera& left, const RigCamera& right,
                                    Duration late, Progress& progress);

}  // namespace tankrig::app
