// The rig file's `targets`: what `calibrate all` shows the cameras, and how long.
#pragma once

#include <string>
#include <vector>

#include "calibration/boards/board_target.hpp"
#include "calibration/marker/marker.hpp"
#include "core/settings_table.hpp"

namespace tankrig {
struct RigConfig;
}

namespace tankrig::app {

/// A flat board as the rig file names it.
struct TargetBoard {
  TargetKind kind = TargetKind::kCheckerboard;
  std::string pattern, dictionary = "4x4_50";
  double square = 0, marker = 0;  ///< [m]

  BoardTarget target() const;
};

/// Shown to the cameras in many places.
struct ShownTarget : TargetBoard {
  std::string scene_board;  ///< its name in a simulated tank's scene
  int pictures = 60;
  double interval = 1;  ///< from one picture to the next [s]
};

/// In the gripper.
struct GripperTarget {
  GripperMarker marker;
  Transform eMg = Transform::Identity();  ///< about: postures are chosen by it
  std::string scene_board;
  int postures = 24;
};

/// A checkerboard that the stripe crosses, before the object and behind it.
struct SheetTarget : TargetBoard {
  static constexpr std::size_t kPlaces = 2;
  std::vector<std::string> scene_boards;  ///< one for each place
};

struct CalibrationTargets {
  ShownTarget board;
  GripperTarget gripper;
  SheetTarget sheet;
};

extern const SettingsTable<CalibrationTargets> kCalibrationTargetKeys;

/// Errors: InputError, also if the rig file has no such section.
CalibrationTargets targets_of(const RigConfig& rig);

}  // namespace tankrig::app
