// Whether to believe a calibration: its figures on data that was held back.
#pragma once

#include <vector>

#include "apps/tankrig/calibrate_all/session_problems.hpp"
#include "core/calibration_file.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

/// Reprojection of a board's corners in pictures of one camera, each with the pose that fits it best.
CalibrationCheck lens_check(const RigCamera& camera, const BoardTarget& target,
                            const std::vector<BoardPicture>& pictures);

/// How far the corners that both eyes place lie from a board of the size it has, once it is laid over them.
CalibrationCheck stereo_check(const RigCamera& left, const RigCamera& right, const BoardTarget& target,
                              const std::vector<BoardPair>& pairs);

/// Reprojection by `camera` of boards that stand where `from` alone sees them. Pairs: `from`, then `camera`.
CalibrationCheck mount_check(const RigCamera& from, const RigCamera& camera, const BoardTarget& target,
                             const std::vector<BoardPair>& pairs);

/// Reprojection of the marker where the arm's joints put it.
CalibrationCheck marker_check(const RigCamera& camera, const ArmModel& arm, const Transform& eMg,
                              const std::vector<HandEyeView>& views);

/// How far the laser places stretches of the stripe off the leaning boards it lies on.
CalibrationCheck sheet_check(const RigCamera& camera, const ArmModel& arm, const Plane& ePl,
                             const std::vector<SheetViews>& boards);

}  // namespace tankrig::app
