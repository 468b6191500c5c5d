// What the laser's sheet is measured from on an arm: the stripe of recorded sweeps.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/calibrate/targets.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "calibration/laser_plane/checkerboard.hpp"
#include "calibration/laser_plane/laser_plane.hpp"
#include "calibration/laser_plane/stripe_points.hpp"
#include "rig/config/rig_config.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// A frame with fewer points of the stripe has no part in it.
inline constexpr std::size_t kLeastOnSheet = 30;

/// The stripe in one frame, where its points are known otherwise than by the laser.
struct SheetView {
  int frame = 0, pass = 0;
  JointVector q = JointVector::Zero(), velocity = JointVector::Zero();
  std::vector<PlacedStripePoint> points;  ///< in c
};
/// On the board that leans in the tank.
struct SheetViews {
  CheckerboardView board;
  std::vector<SheetView> views;
};

/// Errors: InputError if the board is not seen whole while the arm rests, or the stripe hardly crosses it.
SheetViews sheet_views(const OpenedSession& opened, const RigCamera& camera, const TargetBoard& board,
                       Progress& progress);

/// Of views in `camera`.
/// Frames: e.
LaserPlaneProblem sheet_problem(const std::vector<SheetView>& views, const RigConfig& rig, const RigCamera& camera);

}  // namespace tankrig::app
