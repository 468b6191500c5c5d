// `tankrig calibrate stereo`: two cameras and how they stand to each other, from pairs of pictures of a target.

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "apps/tankrig/calibrate/board_pictures.hpp"
#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/facts.hpp"
#include "apps/tankrig/calibrate/intrinsics_json.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "calibration/stereo/stereo.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "session/import/session_import.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CalibrateStereoOptions {
  fs::path data, out;
  std::string model;
  TargetOptions target;
  PortOptions port;
  WriteOptions write;
  bool json = false;
};

struct PictureFiles {
  std::vector<fs::path> left, right;  ///< of the same moments, in the same order
};

/// leftNAME and rightNAME in one folder, NAME with a digit in it; or the same names in its folders left and right.
PictureFiles paired_pictures(const fs::path& data) {
  const bool folders = fs::is_directory(data / "left") && fs::is_directory(data / "right");
  const auto by_key = [&](const std::string& side) {
    std::map<std::string, fs::path> files;
    for (const fs::path& file : images_in(folders ? data / side : data)) {
      const std::string name = file.filename().string();
      if (folders)
        files[file.stem().string()] = file;
      else if (name.starts_with(side) && file.stem().string().find_first_of("0123456789") != name.npos)
        files[file.stem().string().substr(side.size())] = file;
    }
    return files;
  };
  const auto left = by_key("left"), right = by_key("right");
  PictureFiles pairs;
  for (const auto& [key, file] : left) {
    const auto other = right.find(key);
    if (other == right.end()) throw InputError(file, "has no right picture beside it, expected pictures in pairs");
    pairs.left.push_back(file), pairs.right.push_back(other->second);
  }
  for (const auto& [key, file] : right)
    if (!left.contains(key)) throw InputError(file, "has no left picture beside it, expected pictures in pairs");
  if (pairs.left.empty())
    throw InputError(data,
                     "holds no pairs, expected left01.png, right01.png and so on, or folders left and right with "
                     "pictures of the same names");
  return pairs;
}

nlohmann::ordered_json values(const std::vector<Estimate>& estimates) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Estimate& e : estimates) out.push_back(e.value);
  return out;
}

nlohmann::ordered_json stereo_json(const StereoSolution& s) {
  nlohmann::ordered_json out{{"rms_px", {{"left", s.rms_left}, {"right", s.rms_right}, {"stereo", s.rms_stereo}}},
                             {"translation_m", values(s.translation)},
                             {"rotation_vector_rad", values(s.rotation)},
                             {"equation", "p_right = R p_left + T"},
                             {"translation", estimates_json(s.translation)},
                             {"rotation", estimates_json(s.rotation)},
                             {"model", name_of(s.bundle.lens)},
                             {"left", estimates_json(s.left_estimates)},
                             {"right", estimates_json(s.right_estimates)},
                             {"left_decision", s.left.decision},
                             {"right_decision", s.right.decision},
                             {"correlation_allowance", s.noise.allowance},
                             {"bend_mm", {1e3 * s.bundle.bend.x(), 1e3 * s.bundle.bend.y()}},
                             {"pairs", s.bundle.views.size()},
                             {"left_out", s.left_out},
                             {"turned", s.turned},
                             {"rectified_rows_rms_px", s.row_rms}};
  if (const auto& port = s.bundle.cameras[0].port) out["left_port"] = port_json(*port);
  if (const auto& port = s.bundle.cameras[1].port) out["right_port"] = port_json(*port);
  return out;
}

void print(const StereoSolution& s) {
  for (const std::string& pair : s.left_out) fmt::print("left out: {}\n", printable(pair));
  for (const std::string& pair : s.turned)
    fmt::print("{}: the target was read the other way round in the right picture: turned\n", shown_text(pair));
  fmt::print("left: {}\nright: {}\n", s.left.decision, s.right.decision);
  fmt::print("{} pairs; lens model {} of both\n", s.bundle.views.size(), name_of(s.bundle.lens));
  fmt::print("rms a corner: left {:.4f} px, right {:.4f} px by themselves, {:.4f} px together\n", s.rms_left,
             s.rms_right, s.rms_stereo);
  fmt::print("p_right = R p_left + T\n");
  std::vector<Estimate> place = s.translation;
  place.insert(place.end(), s.rotation.begin(), s.rotation.end());
  fmt::print("{}left\n{}right\n{}", estimate_lines(place), estimate_lines(s.left_estimates),
             estimate_lines(s.right_estimates));
  fmt::print("rectified, the corners' rows agree to {:.3f} px (rms)\n", s.row_rms);
}

/// ROS's files with the rectification, or our own of cameras behind ports; and Kalibr's camchain where it can hold the lenses.
void write_files(const fs::path& folder, const StereoSolution& s, Progress& progress) {
  fs::create_directories(folder);
  const CameraModel &left = s.bundle.cameras[0], &right = s.bundle.cameras[1];
  for (const auto& [name, camera, rectification] :
       {std::tuple("left", left, s.left_rectification), {"right", right, s.right_rectification}})
    if (const fs::path file = folder / (std::string(name) + ".yaml"); camera.port)
      write_camera_file(file, CameraFileFormat::kTankrig, {{name, camera, {}, {}}});
    else
      write_camera_file(file, camera, name, rectification);
  std::string lacking = lacking_in(CameraFileFormat::kKalibr, left);
  if (lacking.empty()) lacking = lacking_in(CameraFileFormat::kKalibr, right);
  if (!lacking.empty())
    progress.note("camchain.yaml is not written: Kalibr's format has no place for " + lacking);
  else
    write_camera_file(folder / "camchain.yaml", CameraFileFormat::kKalibr,
                      {{"left", left, Transform::Identity(), {}}, {"right", right, s.rMc, {}}});
}

/// Exit code kPartial if pairs were left out.
int calibrate_stereo(const CalibrateStereoOptions& options) {
  Progress progress;
  std::optional<CalibrationPart> part;
  if (!options.write.file.empty()) part.emplace(options.write);
  StereoProblem problem;
  problem.target = target_of(options.target);
  problem.lens = lens_model_of(options.model);
  const PictureFiles files = paired_pictures(options.data);
  const SearchedPictures left = search_pictures(files.left, problem.target, progress);
  const SearchedPictures right = search_pictures(files.right, problem.target, progress);
  problem.left_size = left.size, problem.right_size = right.size;
  problem.port = options.port.tried();
  if (const fs::path& air = options.port.in_air; !air.empty()) {
    const auto lens = [&](const char* file, cv::Size size) {
      return lens_in_air(read_camera_file(air / file), size.width, size.height, air / file);
    };
    problem.left_in_air = lens("left.yaml", left.size), problem.right_in_air = lens("right.yaml", right.size);
  }
  if (part)
    for (const auto& [role, size] : {std::pair{CameraRole::kLeft, left.size}, {CameraRole::kRight, right.size}})
      part->camera(part->camera(role).name, size.width, size.height);
  std::vector<std::string> not_found;
  for (std::size_t i = 0; i < left.pictures.size(); ++i) {
    const SearchedPicture &in_left = left.pictures[i], &in_right = right.pictures[i];
    if (in_left.search.board && in_right.search.board)
      problem.pairs.push_back({in_left.name + " and " + in_right.name, *in_left.search.board, *in_right.search.board});
    else
      not_found.push_back(in_left.search.board ? in_right.name + ": " + in_right.search.refused
                                               : in_left.name + ": " + in_left.search.refused);
  }
  progress.update("comparing lens models", 0);
  StereoSolution solution = solve(problem);
  solution.left_out.insert(solution.left_out.begin(), not_found.begin(), not_found.end());
  progress.finish_line();
  if (!options.out.empty()) write_files(options.out, solution, progress);
  if (part) {
    std::vector<fs::path> all = files.left;
    all.insert(all.end(), files.right.begin(), files.right.end());
    const CalibrationSource source = CalibrationPart::source("boards, both eyes together", options.data, all);
    put(*part, source, solution);
    part->write();
  }
  if (options.json)
    print_json(stereo_json(solution));
  else
    print(solution);
  return solution.bundle.views.size() == files.left.size() ? kOk : kPartial;
}

}  // namespace

void add_calibrate_stereo(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c = calibrate.add_subcommand(
      "stereo", "Find two cameras and how they stand to each other from pairs of pictures of a target");
  CalibrateStereoOptions& o = options_of(c, chosen, &calibrate_stereo);
  c->footer("Example: tankrig calibrate stereo --data pairs --pattern 9x6 --square-mm 30 --out cameras");
  c->add_option("--data", o.data, "Folder of left01.png, right01.png and so on, or with folders left and right")
      ->required();
  add_target_options(c, o.target);
  add_lens_model_option(c, o.model);
  add_port_options(c, o.port, "Folder of left.yaml and right.yaml, calibrated in air: held behind their ports");
  c->add_option("--out", o.out,
                "Folder for left.yaml and right.yaml (ROS, with the rectification) and camchain.yaml (Kalibr)");
  add_write_options(c, o.write);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
