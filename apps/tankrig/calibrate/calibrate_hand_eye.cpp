// `tankrig calibrate hand-eye`: where the camera stands to the arm, from a marker in the gripper.
#include <fmt/core.h>

#include <cstdio>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/facts.hpp"
#include "apps/tankrig/calibrate/marker_postures.hpp"
#include "apps/tankrig/cloud/cloud_command.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "calibration/hand_eye/hand_eye.hpp"
#include "calibration/hand_eye/hand_eye_file.hpp"
#include "core/angles.hpp"
#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "rig/config/rig_config.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CalibrateHandEyeOptions {
  fs::path data, out;
  WriteOptions write;  // and the rig
  bool keep_arm = false, plan = false, json = false;
};

/// A square that stands for a marker of which only its pose is known.
std::vector<Vector3d> square_of(double side) {
  const double h = side / 2;
  return {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
}

struct FoundViews {
  HandEyeProblem problem;
  std::vector<std::string> without_marker;  ///< pictures
};

FoundViews found_views(const HandEyeData& data, Progress& progress) {
  FoundViews found;
  std::optional<MarkerFinder> finder;
  if (data.marker) finder.emplace(*data.marker);
  for (const HandEyeEntry& entry : data.views) {
    HandEyeView view;
    view.name = entry.name;
    view.q = entry.q;
    if (entry.bMe) view.bMe = *entry.bMe;
    if (entry.cMg) {
      view.cMg = *entry.cMg;
      view.points = square_of(data.marker_size);
    } else {
      progress.update("looking for the marker",
                      static_cast<double>(&entry - data.views.data()) / static_cast<double>(data.views.size()));
      found.problem.camera = data.camera;
      const SeenMarker seen = finder->find(read_picture(entry.image, data.camera->width, data.camera->height, true));
      const auto pose = seen.points.size() < 4 ? std::nullopt : planar_pose(*data.camera, seen);
      if (!pose) {
        found.without_marker.push_back(entry.name);
        continue;
      }
      view.points = seen.points;
      view.corners = seen.corners;
      view.cMg = pose->cMg;
      view.cMg_flipped = pose->flipped;
    }
    found.problem.views.push_back(view);
  }
  return found;
}

nlohmann::ordered_json facts_of(const FoundViews& found, const HandEyeSolution& s) {
  const std::vector<HandEyeView>& views = found.problem.views;
  const double scale = s.pixels ? 1 : 1e3;
  const std::string unit = s.pixels ? "px" : "mm";
  const auto names = [&](const std::vector<std::size_t>& which) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const std::size_t i : which) list.push_back(views[i].name);
    return list;
  };
  nlohmann::ordered_json methods = nlohmann::ordered_json::array(), choices = methods, per_view = methods;
  for (const HandEyeMethod& m : s.methods) {
    nlohmann::ordered_json method{{"name", m.name}};
    if (!m.failure.empty()) method["failure"] = m.failure;
    if (std::isfinite(m.rms) && m.rms > 0) {
      method["rms_" + unit] = scale * m.rms;
      method["from_refined_deg"] = to_degrees(m.rotation);
      method["from_refined_on_target_mm"] = 1e3 * m.at_target;
      method["bMc"] = pose_json(m.cMb.inverse());
    }
    methods.push_back(method);
  }
  for (const ArmChoice& c : s.choices)
    choices.push_back({{"arm", c.name}, {"held_back_rms_" + unit, scale * c.held_back_rms}, {"taken", c.taken}});
  for (std::size_t i = 0; i < views.size(); ++i)
    per_view.push_back({{"name", views[i].name}, {"rms_" + unit, scale * s.view_rms[i]}});
  nlohmann::ordered_json out{{"bMc", pose_json(s.cMb.inverse())},
                             {"eMg", pose_json(s.eMg)},
                             {"target_sigma_mm", 1e3 * s.target_sigma},
                             {"rms_" + unit, scale * s.rms},
                             {"corner_sigma_" + unit, scale * s.corner_sigma},
                             {"joint_sigma_mrad", 1e3 * s.joint_sigma},
                             {"views", views.size() - s.outliers.size()},
                             {"outliers", names(s.outliers)},
                             {"without_marker", found.without_marker},
                             {"flipped", names(s.flipped)},
                             {"refined_from", s.start},
                             {"arm_decision", s.decision},
                             {"arm_choices", choices},
                             {"parameters", estimates_json(s.parameters)},
                             {"methods", methods},
                             {"residuals", per_view}};
  nlohmann::ordered_json dh = nlohmann::ordered_json::array();
  for (const DhLink& link : s.arm.dh)
    dh.push_back({{"a_m", link.a}, {"alpha_rad", link.alpha}, {"d_m", link.d}, {"theta0_rad", link.theta0}});
  out["dh"] = dh;
  return out;
}

void print(const FoundViews& found, const HandEyeSolution& s) {
  const std::vector<HandEyeView>& views = found.problem.views;
  const double scale = s.pixels ? 1 : 1e3;
  const char* const unit = s.pixels ? "px" : "mm";
  std::string out = fmt::format("{} views err by {:.3f} {} per point (corners {:.3f} {}, joints {:.3f} mrad)\n",
                                views.size() - s.outliers.size(), scale * s.rms, unit, scale * s.corner_sigma, unit,
                                1e3 * s.joint_sigma);
  for (const std::size_t i : s.outliers)
    out += fmt::format("left out: {}, which errs by {:.2f} {}\n", views[i].name, scale * s.view_rms[i], unit);
  for (const std::string& name : found.without_marker)
    out += "left out: " + name + ", which does not show the marker\n";
  for (const std::size_t i : s.flipped)
    out += views[i].name + ": the marker's other pose agrees with the other views\n";
  out += "\n" + estimate_lines(s.parameters);
  out += fmt::format("on the target, {:.2f} m away: {:.3f} mm by all of them\n\n", found.problem.target_c.norm(),
                     1e3 * s.target_sigma);
  out += fmt::format("  {:<12} {:>10} {:>14} {:>14}\n", "closed form", unit, "from refined", "on target");
  for (const HandEyeMethod& m : s.methods) {
    if (m.failure.empty())
      out += fmt::format("  {:<12} {:>10.3f} {:>10.4f} deg {:>11.3f} mm{}\n", m.name, scale * m.rms,
                         to_degrees(m.rotation), 1e3 * m.at_target, m.name == s.start ? "  refined from this" : "");
    else
      out += fmt::format("  {:<12} failed: {}\n", m.name, m.failure);
  }
  if (!s.decision.empty()) out += "\narm: " + s.decision + "\n";
  out += "\nfor the rig file: bMc: " + pose_line(s.cMb.inverse()) + "\n";
  for (std::size_t i = 0; i < s.arm.dh.size(); ++i)
    if (const DhLink& now = s.arm.dh[i], &given = found.problem.arm.dh[i];
        now.theta0 != given.theta0 || now.a != given.a || now.alpha != given.alpha || now.d != given.d)
      out += fmt::format("  arm: dh: {}: {{a_m: {}, alpha_rad: {}, d_m: {}, theta0_rad: {}}}\n", kJointNames[i], now.a,
                         now.alpha, now.d, now.theta0);
  std::fputs(out.c_str(), stdout);
}

/// `--plan`: postures in which pictures tell enough, in the order to drive them.
int propose_postures(const CalibrateHandEyeOptions& options) {
  if (options.write.rig.empty()) throw InputError("--plan: expected --rig RIG beside it: whose arm and camera");
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.write.rig));
  const std::vector<JointVector> postures = marker_postures(rig, targets_of(rig).gripper, rig.scan.park, progress);
  progress.finish_line();
  if (options.json) {
    nlohmann::ordered_json out;
    for (const JointVector& q : postures) out["q_rad"].push_back(std::vector<double>(q.begin(), q.end()));
    print_json(out);
    return kOk;
  }
  fmt::print(
      "{} postures from park and back, each move clear of what the rig file names, with the plate; degrees\n    ",
      postures.size());
  for (const char* joint : kJointNames) fmt::print("{:>13}", joint);
  for (std::size_t i = 0; i < postures.size(); ++i) {
    fmt::print("\n{:>4}", i + 1);
    for (const double angle : postures[i]) fmt::print("{:>13.1f}", to_degrees(angle));
  }
  fmt::print("\n");
  return kOk;
}

/// Exit code kPartial if views were left out.
int calibrate_hand_eye(const CalibrateHandEyeOptions& options) {
  if (options.plan) return propose_postures(options);
  if (!options.out.empty()) check_new_file(options.out);
  Progress progress;
  HandEyeData data = read_hand_eye_folder(options.data);
  std::optional<CalibrationPart> part;
  std::optional<RigConfig> rig;
  if (!options.write.file.empty()) {
    if (data.arm) throw InputError(data.file, "arm: expected none beside --write: the rig's");
    part.emplace(options.write);
    rig = part->rig();
  } else if (!options.write.rig.empty()) {
    rig = load_rig(find_rig(options.write.rig));
  }
  const RigCamera* const mono = rig ? rig->find_camera(CameraRole::kMono) : nullptr;
  FoundViews found = found_views(data, progress);
  HandEyeProblem& problem = found.problem;
  problem.arm = data.arm ? *data.arm : rig ? rig->arm : arm5e();
  problem.refine_arm = !options.keep_arm;
  problem.refine_links = !part;  // a calibration.yaml has no place for them
  if (data.target_c)
    problem.target_c = *data.target_c;
  else if (mono)
    problem.target_c = mono->bMc.inverse() * rig->object.bMo.translation();
  if (problem.views.empty())
    throw InputError(data.file,
                     fmt::format("none of {} pictures shows the marker, expected the one that `marker` describes",
                                 data.views.size()));
  const HandEyeSolution solution = solve(problem);
  const nlohmann::ordered_json facts = facts_of(found, solution);
  if (!options.out.empty()) write_file_durably(options.out, yaml_text(facts));
  if (part) {
    std::vector<fs::path> files = data.files;
    for (const HandEyeEntry& entry : data.views)
      if (!entry.image.empty()) files.push_back(entry.image);
    put(*part, CalibrationPart::source("marker in the gripper", data.file.parent_path(), files),
        part->camera(CameraRole::kMono), problem.arm, solution);
    part->write();
  }
  progress.finish_line();
  if (options.json)
    print_json(facts);
  else
    print(found, solution);
  return solution.outliers.empty() && found.without_marker.empty() ? kOk : kPartial;
}

}  // namespace

void add_calibrate_hand_eye(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c =
      calibrate.add_subcommand("hand-eye", "Find where the camera stands to the arm, from a marker in the gripper");
  CalibrateHandEyeOptions& o = options_of(c, chosen, &calibrate_hand_eye);
  c->footer(
      "Example: tankrig calibrate hand-eye --data recordings/marker --rig tank-sim --json\n"
      "         tankrig calibrate hand-eye --plan --rig tank-sim");
  CLI::Option_group* what = c->add_option_group("data or plan");
  what->add_option("--data", o.data, "Folder with hand_eye.yaml: pictures or poses of the marker, and joints");
  what->add_flag("--plan", o.plan, "Propose postures for the pictures, by the rig file's `targets`");
  what->require_option(1);
  c->add_option("--rig", o.write.rig,
                "Name of a rig in etc/rigs, or a rig file: its arm, and its object as the target");
  c->add_option("--out", o.out, "Write the result to this file too");
  c->add_flag("--keep-arm", o.keep_arm, "Do not refine the arm's zeros and links");
  add_write_options(c, o.write);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
