#include "apps/tankrig/calibrate/targets.hpp"

#include "core/input_error.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {
namespace {

const Setting<TargetBoard> kBoardRows[] = {
    {"target", &TargetBoard::kind, "what it is", tankrig::Need::kRequired},
    {"pattern", &TargetBoard::pattern, "COLUMNSxROWS of inner corners, or of dots", tankrig::Need::kRequired},
    {"square_mm", &TargetBoard::square, ConfigRange(0.5, 1000), "side of a square; from dot to dot",
     tankrig::Need::kRequired},
    {"marker_mm", &TargetBoard::marker, ConfigRange(0, 1000), "side of a marker; charuco only"},
    {"dictionary", &TargetBoard::dictionary, "of the markers; charuco only"},
};
void check_board(const ConfigNode& node, const TargetBoard& board) {
  try {
    static_cast<void>(board.target());
  } catch (const InputError& e) {
    node.fail("pattern", e.what());
  }
}
constexpr SettingsTable<TargetBoard> kBoard{kBoardRows, check_board};

const Setting<ShownTarget> kShownRows[] = {
    {"", kBoard},
    {"scene_board", &ShownTarget::scene_board, "its name in the scene; simulated and emulated rigs only"},
    {"pictures", &ShownTarget::pictures, ConfigRange(10, 1000), "by every camera"},
    {"interval_s", &ShownTarget::interval, ConfigRange(0.2, 60), "from one picture to the next"},
};
void check_shown(const ConfigNode& node, const ShownTarget& board) {
  if (board.target().turns().size() > 1)
    node.fail("pattern",
              "found a board that looks the same when turned, expected a ChArUco board, or an odd and an even side");
}
constexpr SettingsTable<ShownTarget> kShown{kShownRows, check_shown};

const Setting<GripperTarget> kGripperRows[] = {
    {"", &GripperTarget::marker, kGripperMarkerKeys},
    {"eMg", &GripperTarget::eMg, "about where the gripper holds it: postures are chosen by it",
     tankrig::Need::kRequired},
    {"scene_board", &GripperTarget::scene_board, "its name in the scene; simulated and emulated rigs only"},
    {"postures", &GripperTarget::postures, ConfigRange(12, 200), "that the arm shows it in"},
};
constexpr SettingsTable<GripperTarget> kGripper{kGripperRows};

const Setting<SheetTarget> kSheetTargetRows[] = {
    {"", kBoard},
    {"scene_boards", &SheetTarget::scene_boards,
     "names in the scene, before the object and behind it; simulated and emulated rigs only"},
};
void check_sheet_target(const ConfigNode& node, const SheetTarget& sheet) {
  if (sheet.kind != TargetKind::kCheckerboard) node.fail("target", "expected a checkerboard: the stripe must cross it");
  if (!sheet.scene_boards.empty() && sheet.scene_boards.size() != SheetTarget::kPlaces)
    node.fail("scene_boards", "expected two, before the object and behind it");
}
constexpr SettingsTable<SheetTarget> kSheetTarget{kSheetTargetRows, check_sheet_target};

const Setting<CalibrationTargets> kRows[] = {
    {"board", &CalibrationTargets::board, kShown, tankrig::Need::kRequired},
    {"gripper", &CalibrationTargets::gripper, kGripper, tankrig::Need::kRequired},
    {"sheet", &CalibrationTargets::sheet, kSheetTarget, tankrig::Need::kRequired},
};

}  // namespace

const SettingsTable<CalibrationTargets> kCalibrationTargetKeys{kRows};

BoardTarget TargetBoard::target() const { return board_target(kind, pattern, square, marker, dictionary); }

CalibrationTargets targets_of(const RigConfig& rig) {
  const auto section = rig.section("targets");
  if (!section)
    throw InputError(rig.file,
                     "targets: is not there, expected what the cameras are shown (docs/reference/rig_keys.md)");
  return settings_from(*section, kCalibrationTargetKeys);
}

}  // namespace tankrig::app
