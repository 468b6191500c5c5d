// `tankrig calibrate camera`: one camera's lens, from pictures of a target.

#include <fmt/core.h>
#include <fnmatch.h>

#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/board_pictures.hpp"
#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/camera_files.hpp"
#include "apps/tankrig/calibrate/camera_pictures.hpp"
#include "apps/tankrig/calibrate/facts.hpp"
#include "apps/tankrig/calibrate/intrinsics_json.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "calibration/boards/corner_table.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "session/import/session_import.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CalibrateCameraOptions {
  fs::path data, out, report;
  std::string glob = "*", model, name = "camera";
  CameraFileFormatOption format;
  TargetOptions target;
  WriteOptions write;
  double distance_m = 0;
  PortOptions port;
  bool json = false;
};

std::vector<fs::path> chosen_images(const fs::path& folder, const std::string& glob) {
  std::vector<fs::path> files = images_in(folder);
  std::erase_if(files, [&](const fs::path& file) { return ::fnmatch(glob.c_str(), file.filename().c_str(), 0) != 0; });
  if (files.empty()) throw InputError(folder, "holds no image named " + shown_text(glob));
  return files;
}

/// Corners that the folder's corners.csv holds, or those found in its pictures.
SearchedPictures corners_in(const CalibrateCameraOptions& options, const BoardTarget& target,
                            std::vector<fs::path>& files, Progress& progress) {
  const fs::path table = options.data / "corners.csv";
  if (!fs::exists(table)) {
    files = chosen_images(options.data, options.glob);
    return search_pictures(files, target, progress);
  }
  files = {table};
  const CornerTable corners = read_corner_table(table, target);
  SearchedPictures searched{corners.size, {}};
  for (const CornerTable::Picture& picture : corners.pictures) {
    if (!picture.search.board) progress.warn(shown_text(picture.name) + ": " + picture.search.refused);
    searched.pictures.push_back({picture.name, picture.search});
  }
  return searched;
}

void print(const IntrinsicsSolution& s, const SearchedPictures& searched, double distance) {
  fmt::print("{} of {} pictures in use, {} corners, {:.0f} % of the image's cells\n", s.bundle.views.size(),
             searched.pictures.size(), s.residuals.size(), 100 * s.coverage.share);
  for (const PictureFit& picture : s.pictures)
    if (picture.left_out)
      fmt::print("left out: {}: {:.2f} px from the camera that the others tell\n", shown_text(picture.name),
                 picture.rms);
  if (!s.left_out_corners.empty()) fmt::print("left out: {} single corners far off\n", s.left_out_corners.size());
  fmt::print("{}\n", s.decision);
  for (const TriedModel& m : s.tried)
    fmt::print("  {:<9} {:<4}  {}fitted {:.4f} px  held back {:.4f} px\n", name_of(m.lens), m.bends ? "bent" : "flat",
               m.port ? "behind a port  " : "", m.rms, m.held_back_rms);
  fmt::print("rms {:.4f} px a corner; sigma of a corner {:.4f} px along x and y\n", s.rms, s.noise.sigma);
  fmt::print("neighbouring corners err alike: every sigma is {:.2f} times that of independent corners\n{}",
             s.noise.allowance, estimate_lines(s.estimates));
  const UncertaintyFigures u = uncertainty_figures(s, distance);
  fmt::print(
      "a point {:.2f} m away is known to {:.2f} px ({:.2f} mm) in the middle, {:.2f} px ({:.2f} mm) where boards "
      "were seen (worst), {:.2f} px ({:.2f} mm) anywhere (worst); one sigma\n",
      distance, u.middle.px, 1e3 * u.middle.metres, u.seen.px, 1e3 * u.seen.metres, u.anywhere.px,
      1e3 * u.anywhere.metres);
}

/// Exit code kPartial if pictures were left out.
int calibrate_camera(const CalibrateCameraOptions& options) {
  Progress progress;
  std::optional<CalibrationPart> part;
  if (!options.write.file.empty()) part.emplace(options.write);
  IntrinsicsProblem problem;
  problem.target = target_of(options.target);
  problem.lens = lens_model_of(options.model);
  problem.port = options.port.tried();
  std::vector<fs::path> files;
  const SearchedPictures searched = corners_in(options, problem.target, files, progress);
  if (part) part->camera(options.name, searched.size.width, searched.size.height);
  problem.width = searched.size.width, problem.height = searched.size.height;
  if (!options.port.in_air.empty())
    problem.in_air =
        lens_in_air(read_camera_file(options.port.in_air), problem.width, problem.height, options.port.in_air);
  for (const SearchedPicture& picture : searched.pictures)
    if (picture.search.board) problem.pictures.push_back({picture.name, *picture.search.board});
  progress.update("comparing lens models", 0);
  const IntrinsicsSolution solution = solve(problem);
  progress.finish_line();
  const double distance = options.distance_m > 0 ? options.distance_m : solution.mean_distance();
  nlohmann::ordered_json facts = intrinsics_json(solution, distance);
  for (const SearchedPicture& picture : searched.pictures)
    if (!picture.search.board) facts["not_found"][picture.name] = picture.search.refused;
  if (!options.out.empty())
    write_camera_file(options.out, solution.camera.port ? CameraFileFormat::kTankrig : options.format.of(options.out),
                      {{options.name, solution.camera, {}, {}}});
  if (part) {
    part->values.camera(options.name).lens =
        calibrated_lens(solution.camera, solution.estimates, solution.rms, solution.bundle.views.size(),
                        CalibrationPart::source("boards", options.data, files));
    part->write();
  }
  if (!options.report.empty()) {
    write_camera_pictures(options.report, solution, distance);
    write_whole_file(options.report / "calibration.json", facts.dump(2) + "\n");
  }
  if (options.json)
    print_json(facts);
  else
    print(solution, searched, distance);
  const bool all = solution.bundle.views.size() == searched.pictures.size();
  return all ? kOk : kPartial;
}

}  // namespace

void add_calibrate_camera(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c =
      calibrate.add_subcommand("camera", "Find a camera's focal lengths and distortion from pictures of a target");
  CalibrateCameraOptions& o = options_of(c, chosen, &calibrate_camera);
  c->footer(
      "Example: tankrig calibrate camera --data pictures --pattern 9x6 --square-mm 30 --out camera.yaml --report "
      "report");
  c->add_option("--data", o.data, "Folder of pictures of the target, or of a corners.csv")->required();
  c->add_option("--files", o.glob, "Only pictures whose names match, as in a shell: 'left*.jpg'")
      ->capture_default_str();
  add_target_options(c, o.target);
  add_lens_model_option(c, o.model);
  add_port_options(c, o.port, "Camera file of the lens, calibrated in air: held behind the port");
  c->add_option("--distance-m", o.distance_m, "Working distance of the uncertainty (default: the targets' mean)")
      ->check(CLI::Range(1e-3, 100.0));
  c->add_option("--out", o.out, "Camera file to write");
  add_camera_format_option(c, o.format);
  c->add_option("--name", o.name, "The camera's name, in its file and in the rig")->capture_default_str();
  c->add_option("--report", o.report, "Folder for calibration.json, coverage.png, residuals.png and uncertainty.png");
  add_write_options(c, o.write);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
