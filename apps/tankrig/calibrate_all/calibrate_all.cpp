// `tankrig calibrate all`: a whole rig, step by step; what was recorded is kept and not recorded again.
#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate_all/calibration_page.hpp"
#include "apps/tankrig/calibrate_all/checks_output.hpp"
#include "apps/tankrig/calibrate_all/guided_calibration.hpp"
#include "apps/tankrig/calibrate_all/truth.hpp"
#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "core/shown_text.hpp"

namespace tankrig::app {
namespace {

nlohmann::ordered_json json_of(const Misplaced& m) {
  return {{"rms_mm", 1e3 * m.rms}, {"mean_mm", 1e3 * m.mean}, {"places", m.places}};
}

nlohmann::ordered_json json_of(const Misplacement& m) {
  return {{"laser", json_of(m.laser)}, {"stereo", json_of(m.stereo)}};
}

nlohmann::ordered_json json_of(const Calibration& judged, const JointOutcome& joint,
                               const std::optional<TruthComparison>& truth, const std::filesystem::path& file) {
  nlohmann::ordered_json out{{"calibration", file.string()},
                             {"verdict", name_of(judged.verdict)},
                             {"checks", checks_json(judged.checks)},
                             {"joint", joint_json(joint)}};
  if (truth)
    out["truth"] = {{"object_as_calibrated", json_of(truth->calibrated.places)},
                    {"object_as_clicked", json_of(truth->clicked.places)},
                    {"object_as_it_is", json_of(truth->on_true_object)},
                    {"object_rms_mm", 1e3 * truth->calibrated.off},
                    {"clicked_object_rms_mm", 1e3 * truth->clicked.off}};
  return out;
}

void print(const Calibration& judged, const std::optional<TruthComparison>& truth, const std::filesystem::path& file) {
  fmt::print("on data that was held back:\n");
  print_checks(judged.checks);
  if (truth) {
    fmt::print("in truth, of the simulated tank, places come to lie off the object's surface by\n");
    fmt::print("  {:<32} {:>12} {:>12}\n", "mm, root mean square", "laser", "stereo");
    const auto line = [](const char* where, const Misplacement& m) {
      fmt::print("  {:<32} {:>12.3f} {:>12.3f}\n", where, 1e3 * m.laser.rms, 1e3 * m.stereo.rms);
    };
    line("object where it truly stands", truth->on_true_object);
    line("object where it was calibrated", truth->calibrated.places);
    line("object where it was clicked", truth->clicked.places);
    fmt::print("  the object itself is {:.3f} mm off; as clicked, before snapping, {:.3f} mm\n",
               1e3 * truth->calibrated.off, 1e3 * truth->clicked.off);
  }
  fmt::print("{}: {}, {}\n", name_of(judged.verdict), shown_text(file.string()),
             shown_text((file.parent_path() / "report" / "calibration.html").string()));
}

int calibrate_all(const GuidedOptions& options) {
  Progress progress;
  GuidedCalibration calibration(options, progress);
  calibration.boards();
  calibration.marker();
  calibration.sweep();
  calibration.sheet();
  calibration.joint();
  if (!calibration.object()) return kPartial;
  const Calibration judged = calibration.judge();
  const RigConfig drawn = load_drawn_rig(find_rig(options.scan.rig));
  const RigConfig rig = load_rig(find_rig(options.scan.rig), "", calibration.file());
  std::optional<TruthComparison> truth;
  if (!rig.scene.empty())
    truth = compare_with_truth(rig, calibration.bMo_clicked(), load_world(rig, options.scan.world));
  write_calibration_page(options.folder, rig, drawn, calibration.joint_outcome(), truth);
  Feed::one().report(options.folder / "report" / "calibration.html");
  progress.finish_line();
  if (options.scan.json)
    print_json(json_of(judged, calibration.joint_outcome(), truth, calibration.file()));
  else
    print(judged, truth, calibration.file());
  return judged.verdict == CalibrationVerdict::kAccepted ? kOk : kFailure;
}

}  // namespace

void add_calibrate_all(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c = calibrate.add_subcommand("all", "Calibrate a whole rig, step by step, and judge the result");
  GuidedOptions& o = options_of(c, chosen, &calibrate_all);
  c->footer(
      "Exit codes: 0 accepted; 1 rejected, or failed; 2 wrong command line; 3 corners are still to be clicked.\n"
      "Example: tankrig calibrate all --rig tank-true --data calibrations/monday");
  add_rig_option(c, o.scan.rig);
  c->add_option("--data", o.folder, "Folder for recordings, calibration.yaml and report; go on where it was stopped")
      ->required();
  add_world_options(c, o.scan.world);
  c->add_option("--click-sigma-px", o.click_sigma, "How badly the simulated operator clicks")
      ->check(CLI::Range(0.0, 20.0))
      ->capture_default_str();
  add_port_options(c, o.port, "calibration.yaml of the rig in air: its lenses are held behind their ports");
  add_carrier_option(c, o.scan.carrier);
  c->add_option("--operator", o.scan.operator_name, "Name of whoever calibrates");
  add_waive_option(c, o.scan.waived);
  c->add_flag("--yes", o.scan.yes, "With devices: do not ask before anything moves or shines");
  add_json_flag(c, o.scan.json);
}

}  // namespace tankrig::app
