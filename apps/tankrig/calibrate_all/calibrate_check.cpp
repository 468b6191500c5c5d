// `tankrig calibrate check`: one sweep over a leaning board, or over the object, tells whether a calibration still holds.
#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/dark_frames.hpp"
#include "apps/tankrig/calibrate_all/checks_output.hpp"
#include "apps/tankrig/calibrate_all/held_back_checks.hpp"
#include "apps/tankrig/calibrate_all/object_checks.hpp"
#include "apps/tankrig/calibrate_all/step_session.hpp"
#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/command_line/confirm.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "apps/tankrig/scan/recorded_session.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "reconstruction/pointcloud/registration.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CheckOptions {
  ScanOptions scan;
  std::string over = "board";
};

/// The board while the arm rests, and the stripe on it, there and back.
std::vector<CalibrationCheck> checks_of(const OpenedSession& opened, const RigConfig& rig, const TargetBoard& board,
                                        Progress& progress) {
  const RigCamera &mono = *rig.find_camera(CameraRole::kMono), &left = *rig.find_camera(CameraRole::kLeft),
                  &right = *rig.find_camera(CameraRole::kRight);
  const BoardTarget target = board.target();
  const auto seen_by = [&](const RigCamera& camera) {
    const BoardSearch search = find_board(grey_of(dark_picture(opened.session, camera.name)), target);
    if (!search.board)
      throw InputError(opened.session.path, "camera " + camera.name + ": " + search.refused +
                                                ", expected every camera to see the board `sheet` whole");
    return *search.board;
  };
  const FoundBoard in_mono = seen_by(mono), in_left = seen_by(left), in_right = seen_by(right);
  return {lens_check(mono, target, {{mono.name, in_mono}}),
          mount_check(left, mono, target, {{left.name, in_left, in_mono}}),
          stereo_check(left, right, target, {{left.name, in_left, in_right}}),
          sheet_check(mono, rig.arm, rig.laser.ePl, {sheet_views(opened, mono, board, progress)})};
}

int calibrate_check(const CheckOptions& given) {
  Progress progress;
  ScanOptions options = given.scan;
  const bool over_object = given.over == "object";
  options.command = "calibrate check";
  const fs::path file = find_rig(options.rig);
  RigConfig rig = load_rig(file, "", options.calibration);
  for (const CameraRole role : {CameraRole::kMono, CameraRole::kLeft, CameraRole::kRight})
    if (!rig.find_camera(role))
      throw InputError(file,
                       std::string("has no camera of the role ") + name_of(role) + ", expected mono, left and right");
  if (!rig.calibration)
    throw InputError(file, "names no calibration, expected `calibration: FILE` there, or --calibration FILE");
  const SheetTarget sheet = targets_of(rig).sheet;
  for (const std::string& warning : calibration_warnings(rig)) progress.warn(warning);
  if (!over_object && !sheet.scene_boards.empty()) options.world.boards = {sheet.scene_boards.front()};
  const bool person = rig.scene.empty();
  const fs::path session = options.out.empty() ? default_session(rig.name) : options.out;
  const OpenedSession opened =
      recorded_session(options, rig, session, there_and_back(rig), progress, [&](ScanOptions&) {
        if (person)
          confirm(over_object ? "Leave the object in the tank, and nothing else. Ready?"
                              : "Lean the checkerboard over the object, on the arm's side of it. Ready?",
                  options.yes);
      });
  ObjectChecks by_object;
  if (over_object) {
    by_object = object_checks(opened.session, progress);
    if (by_object.moved)
      progress.note(fmt::format(
          "the object is {:.1f} mm and {:.2f} deg from where the rig has it: moved since, or the calibration is off",
          1e3 * by_object.moved->translation().norm(), to_degrees(rotation_angle(*by_object.moved))));
  }
  const std::vector<CalibrationCheck> checks = over_object ? by_object.checks : checks_of(opened, rig, sheet, progress);
  const bool holds = all_passed(checks);
  progress.finish_line();
  if (options.json) {
    print_json({{"calibration", rig.calibration->file.string()},
                {"session", session.string()},
                {"simulated_s", opened.session.info.simulated_s},
                {"holds", holds},
                {"checks", checks_json(checks)}});
  } else {
    print_checks(checks);
    fmt::print("{}: {}\n", holds ? "holds" : "holds no longer, calibrate again",
               shown_text(rig.calibration->file.string()));
  }
  return holds ? kOk : kFailure;
}

}  // namespace

void add_calibrate_check(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c = calibrate.add_subcommand(
      "check", "Does a calibration still hold? One sweep over a leaning board, or the object, tells");
  CheckOptions& check = options_of(c, chosen, &calibrate_check);
  ScanOptions& o = check.scan;
  c->footer(
      "Exit codes: 0 it holds; 1 it does not, or failed; 2 wrong command line.\n"
      "Example: tankrig calibrate check --rig tank-true --calibration calibrations/monday/calibration.yaml");
  add_rig_option(c, o.rig);
  add_calibration_option(c, o.calibration);
  c->add_option("--over", check.over, "What is swept: the checkerboard leaning over the object, or the object itself")
      ->check(CLI::IsMember({"board", "object"}))
      ->capture_default_str();
  c->add_option("--out", o.out, "The sweep's session; sessions/RIG-TIME if not given");
  add_world_options(c, o.world);
  add_carrier_option(c, o.carrier);
  c->add_option("--operator", o.operator_name, "Name of whoever checks");
  add_waive_option(c, o.waived);
  c->add_flag("--yes", o.yes, "With devices: do not ask before anything moves or shines");
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
