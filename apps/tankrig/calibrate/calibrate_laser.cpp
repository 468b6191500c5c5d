// `tankrig calibrate laser`: the laser's sheet, from sweeps of an arm over a board, or from pictures of its stripe on one.

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/laser_data.hpp"
#include "apps/tankrig/calibrate/sheet_data.hpp"
#include "apps/tankrig/calibrate/time_data.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "session/import/session_import.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CalibrateLaserOptions {
  std::vector<fs::path> sessions;
  WriteOptions write;
  fs::path data, camera;
  std::string pattern;
  double square_mm = 0;
  bool json = false;
};

struct Measured {
  const char* frame;
  LaserData data;
  LaserPlaneSolution plane;
};

nlohmann::ordered_json json_of(const Measured& m) {
  const LaserPlaneSolution& s = m.plane;
  nlohmann::ordered_json out{
      {"frame", m.frame},
      {"plane",
       {{"normal", {s.plane.normal.x(), s.plane.normal.y(), s.plane.normal.z()}}, {"offset_m", s.plane.offset}}},
      {"rms_mm", 1e3 * s.rms},
      {"held_back_rms_mm", 1e3 * s.held_back_rms},
      {"sigma_mrad", 1e3 * s.sigma_rad},
      {"sigma_mm", 1e3 * s.sigma_m},
      {"effect_sigma_mm", 1e3 * s.effect_sigma},
      {"points", s.residuals.size()},
      {"inlier_share", s.inlier_share}};
  out["board_rms_px"] = m.data.board_rms;
  for (std::size_t g = 0; g < s.groups.size(); ++g)
    out["pictures"].push_back({{"name", m.data.problem.groups[g].name},
                               {"points", s.groups[g].points},
                               {"inliers", s.groups[g].inliers},
                               {"mean_mm", 1e3 * s.groups[g].mean},
                               {"rms_mm", 1e3 * s.groups[g].rms}});
  out["left_out"] = m.data.left_out;
  return out;
}

void print(const Measured& m) {
  const LaserPlaneSolution& s = m.plane;
  const Vector3d& n = s.plane.normal;
  fmt::print("plane in {}: normal [{:.6f}, {:.6f}, {:.6f}], offset {:.6f} m\n", m.frame, n.x(), n.y(), n.z(),
             s.plane.offset);
  fmt::print("  {} of {} points in {} pictures within {:.3f} mm rms; held back {:.3f} mm\n",
             static_cast<std::size_t>(std::lround(s.inlier_share * static_cast<double>(s.residuals.size()))),
             s.residuals.size(), s.groups.size(), 1e3 * s.rms, 1e3 * s.held_back_rms);
  fmt::print("  direction +- {:.3f} mrad, distance +- {:.3f} mm; on the target +- {:.3f} mm along the rays\n",
             1e3 * s.sigma_rad, 1e3 * s.sigma_m, 1e3 * s.effect_sigma);
  for (std::size_t g = 0; g < s.groups.size() && s.groups.size() <= 12; ++g)
    fmt::print("    {:<20} {:>5} points  mean {:>7.3f} mm  rms {:.3f} mm\n", shown_text(m.data.problem.groups[g].name),
               s.groups[g].inliers, 1e3 * s.groups[g].mean, 1e3 * s.groups[g].rms);
}

Measured by_pictures(const CalibrateLaserOptions& options, Progress& progress) {
  const Checkerboard board = checkerboard_of(options.pattern, 1e-3 * options.square_mm);
  LaserData data = laser_data_of_pictures(images_in(options.data), read_camera_file(options.camera), board, progress);
  for (const std::string& why : data.left_out) progress.warn("left out: " + shown_text(why));
  LaserPlaneSolution plane = solve(data.problem);
  return {"c", std::move(data), std::move(plane)};
}

/// Into the calibration file too, if one is named.
Measured by_sweeps(const CalibrateLaserOptions& options, Progress& progress) {
  CalibrationPart part(options.write);
  const RigConfig& rig = part.rig();
  const RigCamera& camera = part.camera(CameraRole::kMono);
  const SheetTarget board = targets_of(rig).sheet;
  std::vector<OpenedSession> sessions;
  std::vector<SheetView> views;
  double squares = 0;
  for (const fs::path& path : options.sessions) {
    const OpenedSession& opened = sessions.emplace_back(open_with_warnings(path, progress));
    if (opened.session.info.rig != rig.name)
      throw InputError(path, "is of rig " + shown_text(opened.session.info.rig) + ", expected " + rig.name);
    SheetViews seen = sheet_views(opened, camera, board, progress);
    squares += seen.board.rms * seen.board.rms;
    views.insert(views.end(), seen.views.begin(), seen.views.end());
  }
  LaserData data{sheet_problem(views, rig, camera), {}, std::sqrt(squares / static_cast<double>(sessions.size()))};
  LaserPlaneSolution plane = solve(data.problem);
  if (!options.write.file.empty()) {
    part.values.laser = {
        CalibrationPart::source("stripe on checkerboards", sessions.front().session.path, recorded_files(sessions)),
        plane.plane, plane.sigma_rad, plane.sigma_m, plane.rms};
    part.write();
  }
  return {"e", std::move(data), std::move(plane)};
}

int calibrate_laser(const CalibrateLaserOptions& options) {
  Progress progress;
  const Measured m = options.sessions.empty() ? by_pictures(options, progress) : by_sweeps(options, progress);
  progress.finish_line();
  if (options.json)
    print_json(json_of(m));
  else
    print(m);
  return kOk;
}

}  // namespace

void add_calibrate_laser(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c = calibrate.add_subcommand("laser", "Find the laser's plane from its stripe on a checkerboard");
  CalibrateLaserOptions& o = options_of(c, chosen, &calibrate_laser);
  c->footer(
      "Example: tankrig calibrate laser monday/sheet-before monday/sheet-behind --rig tank-sim --write "
      "calibration.yaml\n"
      "         tankrig calibrate laser --data pictures --camera camera.yaml --pattern 6x8 --square-mm 40 --json");
  CLI::Option* camera = c->add_option("--camera", o.camera, "Camera file")->check(CLI::ExistingFile);
  CLI::Option* pattern = c->add_option("--pattern", o.pattern,
                                       "COLUMNSxROWS of the checkerboard's inner corners: 9x6 is ten by seven squares");
  CLI::Option* square = c->add_option("--square-mm", o.square_mm, "Side of a square")->check(CLI::Range(0.5, 1000.0));
  add_write_options(c, o.write);
  CLI::Option_group* what = c->add_option_group("sessions or data");
  CLI::Option* sessions = add_sessions_option(what, o.sessions,
                                              "Session folders, each a sweep over the checkerboard of the rig file's "
                                              "`targets: sheet`")
                              ->required(false);
  CLI::Option* data = what->add_option(
      "--data", o.data, "Folder of pictures that show the stripe on the board, camera and laser as one body");
  what->require_option(1);
  sessions->needs(c->get_option("--rig"));
  c->get_option("--write")->needs(sessions);
  data->needs(camera)->needs(pattern)->needs(square);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
