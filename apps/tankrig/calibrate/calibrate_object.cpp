// `tankrig calibrate object`: the object's pose from clicked corners, the paper's ground truth.
#include <fmt/core.h>

#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/facts.hpp"
#include "apps/tankrig/calibrate/object_picture.hpp"
#include "apps/tankrig/cloud/cloud_command.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "bench/metrics/alignment.hpp"
#include "calibration/object_pose/corners_file.hpp"
#include "calibration/object_pose/snap.hpp"
#include "core/angles.hpp"
#include "core/atomic_file.hpp"
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "session/recording/png_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CalibrateObjectOptions {
  fs::path data, image, corners, camera, object, out, picture, cloud, calibration;
  WriteOptions write;
  std::string of = "mono";
  bool raw = false, json = false;

  bool of_rig() const { return !write.file.empty() || !write.rig.empty(); }
};

/// What the options name, or else the corners file.
struct Inputs {
  CornersFile file;
  fs::path corners, image, camera, object;
};

Inputs inputs_of(const CalibrateObjectOptions& o) {
  if (o.data.empty() == o.corners.empty())
    throw InputError("calibrate object: expected --data FOLDER or --corners FILE");
  const fs::path corners = o.corners.empty() ? o.data / "corners.yaml" : o.corners;
  Inputs in{read_corners(corners), corners, o.image, o.camera, o.object};
  for (const auto& [name, option, named] :
       {std::tuple{"image", &in.image, &in.file.image}, std::tuple{"camera", &in.camera, &in.file.camera},
        std::tuple{"object", &in.object, &in.file.object}}) {
    if (option->empty()) *option = *named;
    if (option->empty() && (!o.of_rig() || option == &in.image))
      throw InputError(corners, fmt::format("{}: is not there, expected a file, here or as --{}", name, name));
  }
  return in;
}

/// A second opinion: where the cloud, given in c, lies on the mesh. It changes nothing.
Registration opinion_of_cloud(const fs::path& file, const TriangleMesh& mesh, const Transform& cMo) {
  return register_cloud(surface_cloud(ObjectSurface(mesh)), transformed(cMo.inverse(), read_cloud(file), "o"),
                        Transform::Identity());
}

nlohmann::ordered_json facts_of(const ObjectPoseProblem& problem, const SnappedPose& pose) {
  const ObjectPoseSolution& s = pose.snapped;
  nlohmann::ordered_json corners = nlohmann::ordered_json::array(), methods = corners;
  for (std::size_t k = 0; k < problem.corners.size(); ++k) {
    const ClickedCorner& c = problem.corners[k];
    nlohmann::ordered_json corner{{"name", c.name}, {"clicked_px", {c.pixel.x(), c.pixel.y()}}};
    if (!pose.corners.empty()) {
      const SnappedCorner& moved = pose.corners[k];
      if (moved.why_not.empty())
        corner["snapped_px"] = {moved.corner.pixel.x(), moved.corner.pixel.y()},
        corner["sigma_px"] = moved.corner.sigma;
      else
        corner["not_snapped"] = moved.why_not;
    }
    corner["residual_px"] = {s.residuals_px[k].x(), s.residuals_px[k].y()};
    corners.push_back(corner);
  }
  for (const PoseMethod& m : pose.raw.methods) {
    nlohmann::ordered_json method{{"name", m.name}};
    if (m.failure.empty())
      method["rms_px"] = m.rms_px, method["from_refined_deg"] = to_degrees(m.rotation),
      method["from_refined_mm"] = 1e3 * m.translation;
    else
      method["failure"] = m.failure;
    methods.push_back(method);
  }
  nlohmann::ordered_json out{{"cMo", pose_json(s.cMo)},
                             {"surface_sigma_mm", 1e3 * s.surface.rms},
                             {"surface_sigma_most_mm", 1e3 * s.surface.most},
                             {"rms_px", s.rms_px},
                             {"raw_rms_px", pose.raw.rms_px},
                             {"raw_surface_sigma_mm", 1e3 * pose.raw.surface.rms},
                             {"refined_from", pose.raw.start},
                             {"parameters", estimates_json(s.parameters)},
                             {"corners", corners},
                             {"methods", methods}};
  if (s.rival)
    out["rival"] = {
        {"cMo", pose_json(s.rival->cMo)}, {"rms_px", s.rival->rms_px}, {"rotation_deg", to_degrees(s.rival->rotation)}};
  return out;
}

void print(const ObjectPoseProblem& problem, const SnappedPose& pose) {
  const ObjectPoseSolution& s = pose.snapped;
  std::string out = fmt::format("  {:<22} {:>10} {:>14} {:>12}\n", "method on the clicks", "px", "from refined", "");
  for (const PoseMethod& m : pose.raw.methods)
    out += m.failure.empty() ? fmt::format("  {:<22} {:>10.3f} {:>10.4f} deg {:>9.3f} mm{}\n", m.name, m.rms_px,
                                           to_degrees(m.rotation), 1e3 * m.translation,
                                           m.name == pose.raw.start ? "  smallest, refined from this" : "")
                             : fmt::format("  {:<22} failed: {}\n", m.name, m.failure);
  out += fmt::format("\nclicks err by {:.3f} px; they put the surface off by {:.3f} mm (one sigma)\n", pose.raw.rms_px,
                     1e3 * pose.raw.surface.rms);
  for (std::size_t k = 0; k < pose.corners.size(); ++k)
    out += pose.corners[k].why_not.empty()
               ? fmt::format("  {}: snapped by {:.2f} px, +- {:.3f} px\n", problem.corners[k].name,
                             (pose.corners[k].corner.pixel - problem.corners[k].pixel).norm(),
                             pose.corners[k].corner.sigma)
               : fmt::format("  {}: stays as clicked: {}\n", problem.corners[k].name, pose.corners[k].why_not);
  if (!pose.corners.empty()) out += fmt::format("snapped clicks err by {:.3f} px\n", s.rms_px);
  out += "\n" + estimate_lines(s.parameters);
  out += fmt::format("surface off by {:.3f} mm, at most {:.3f} mm (one sigma, along its normals)\ncMo: {}\n",
                     1e3 * s.surface.rms, 1e3 * s.surface.most, pose_line(s.cMo));
  if (s.rival)
    out += fmt::format(
        "a pose turned by {:.1f} deg fits alike, with {:.3f} px: click more corners, off the plane of these\n",
        to_degrees(s.rival->rotation), s.rival->rms_px);
  std::fputs(out.c_str(), stdout);
}

/// Exit code kPartial if a corner could not be snapped, or another pose fits alike.
int calibrate_object(const CalibrateObjectOptions& options) {
  for (const fs::path& out : {options.out, options.picture})
    if (!out.empty()) check_new_file(out);
  Progress progress;
  Inputs in = inputs_of(options);
  std::optional<CalibrationPart> part;
  const RigCamera* eye = nullptr;
  if (options.of_rig()) {
    const bool writes = !options.write.file.empty();
    part.emplace(WriteOptions{writes ? options.write.file : options.calibration, options.write.rig});
    eye = &part->camera(options.of);
    if (!in.camera.empty()) throw InputError(in.camera, "expected no camera file beside --rig: the rig's lens");
    if (in.object.empty()) in.object = part->rig().object.mesh;
  }
  const TriangleMesh mesh = read_mesh(in.object);
  const CameraModel camera = part ? eye->model : read_camera_file(in.camera);
  ObjectPoseProblem problem{camera, {}, {mesh.vertices, mesh.triangles}};
  problem.corners = clicked_corners(in.file, problem.shape);
  if (in.file.most_rms_px) problem.most_rms_px = *in.file.most_rms_px;
  const cv::Mat picture = read_picture(in.image, camera.width, camera.height, false);
  SnappedPose pose;
  if (options.raw) {
    pose.raw = pose.snapped = solve(problem);
  } else {
    cv::Mat grey;
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    pose = solve_with_snapping(grey, problem);
  }
  nlohmann::ordered_json facts = facts_of(problem, pose);
  std::string opinion;
  if (!options.cloud.empty()) {
    const Registration found = opinion_of_cloud(options.cloud, mesh, pose.snapped.cMo);
    facts["cloud"] = to_json(found);
    const std::string why = doubt(found, 0.3);
    if (!why.empty()) facts["cloud"]["doubt"] = why;
    opinion = fmt::format(
        "the cloud would have the object {:.2f} mm and {:.3f} deg elsewhere ({} points, rms {:.2f} mm){}{}; the pose "
        "stays\n",
        1e3 * found.aMb.translation().norm(), to_degrees(rotation_angle(found.aMb)), found.pairs, 1e3 * found.rms_m,
        why.empty() ? "" : ", not to be believed: ", why);
  }
  if (!options.picture.empty())
    write_file_durably(options.picture, png_of(object_picture(picture, problem, pose), options.picture));
  if (!options.out.empty()) write_file_durably(options.out, yaml_text(facts));
  if (!options.write.file.empty()) {
    put(*part, CalibrationPart::source("clicked corners", in.corners.parent_path(), {in.corners, in.image, in.object}),
        *eye, pose.snapped);
    part->write();
  }
  progress.finish_line();
  if (options.json) {
    print_json(facts);
  } else {
    print(problem, pose);
    std::fputs(opinion.c_str(), stdout);
  }
  const bool all =
      std::all_of(pose.corners.begin(), pose.corners.end(), [](const SnappedCorner& c) { return c.why_not.empty(); });
  return all && !pose.snapped.rival ? kOk : kPartial;
}

}  // namespace

void add_calibrate_object(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c =
      calibrate.add_subcommand("object", "Find the object's pose from clicked corners: the paper's ground truth");
  CalibrateObjectOptions& o = options_of(c, chosen, &calibrate_object);
  c->footer(
      "Example: tankrig calibrate object --image dark.png --corners corners.yaml --camera left.yaml --object "
      "etc/objects/black_box.obj");
  c->add_option("--data", o.data, "Folder with corners.yaml and what it names");
  c->add_option("--corners", o.corners, "The clicked corners");
  c->add_option("--image", o.image, "The picture they were clicked in (default: the corners file's)");
  c->add_option("--camera", o.camera, "Camera file (likewise)");
  c->add_option("--object", o.object, "Mesh (likewise; with --rig: the rig's)");
  c->add_option("--cloud", o.cloud, "A cloud in the camera's frame, for a second opinion by ICP; it changes nothing");
  c->add_option("--picture", o.picture, "Write the picture with clicks and edges to this PNG file");
  c->add_option("--out", o.out, "Write the result to this file too");
  c->add_flag("--raw", o.raw, "Do not snap the clicks to the picture's edges");
  add_write_options(c, o.write);
  add_calibration_option(c, o.calibration);
  c->get_option("--calibration")->needs(c->get_option("--rig"))->excludes(c->get_option("--write"));
  c->add_option("--of", o.of, "With --rig: the rig's camera that took the picture; lens and place are the rig's")
      ->capture_default_str();
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
