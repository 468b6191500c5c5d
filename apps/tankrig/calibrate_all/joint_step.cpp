#include "apps/tankrig/calibrate_all/joint_step.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/input_error.hpp"
#include "core/lens_numbers.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

// A figure may be worse by this share: by chance it is, one way or the other.
constexpr double kNoWorse = 1.02;

/// Of camera `name`'s stamps, beyond what they were corrected by [s].
const Estimate& delay_of(const JointSolution& found, const std::string& name) {
  return *found.parameter(name + " delay");
}

/// The stripe placed on its board by another lens, at the joints of other stamps.
SheetViews placed_by(const CameraModel& lens, const CameraModel& before, double delay, const SheetViews& sheet) {
  SheetViews out = sheet;
  if (const auto pose = planar_pose(lens, {sheet.board.points, sheet.board.corners})) out.board.cMt = pose->cMg;
  const Plane board = out.board.cMt * Plane{Vector3d::UnitZ(), 0};
  for (SheetView& view : out.views) {
    view.q -= delay * view.velocity;
    for (PlacedStripePoint& point : view.points) {
      const auto pixel = before.project(point.p);
      const ViewingRay sight = lens.sight(pixel->x(), pixel->y());
      point.p = sight.at(-board.distance(sight.origin) / board.normal.dot(sight.direction));
    }
  }
  return out;
}

std::vector<CalibrationCheck> checks_of(const JointStep& step, const JointSolution& found,
                                        const CalibrationPart& part) {
  RigCamera mono = part.camera(CameraRole::kMono), left = part.camera(CameraRole::kLeft),
            right = part.camera(CameraRole::kRight);
  const CameraModel before = mono.model;
  RigCamera* const cameras[] = {&mono, &left, &right};
  for (std::size_t k = 0; k < std::size(cameras); ++k) {
    cameras[k]->model = found.boards.cameras[k];
    cameras[k]->bMc = found.bMk[k];
  }
  const BoardTarget& target = step.problem.boards.target;
  std::vector<SheetViews> back;
  const double delay = delay_of(found, mono.name).value;
  for (const SheetViews& sheet : step.ways_back) back.push_back(placed_by(mono.model, before, delay, sheet));
  return {lens_check(mono, target, step.mono_boards), stereo_check(left, right, target, step.both_eyes),
          mount_check(left, mono, target, step.left_and_mono), marker_check(mono, found.arm, found.eMg, step.marker),
          sheet_check(mono, found.arm, found.ePl, back)};
}

void put(CalibrationPart& part, const CalibrationSource& source, const JointSolution& found, int views) {
  const CameraRole roles[] = {CameraRole::kMono, CameraRole::kLeft, CameraRole::kRight};
  for (std::size_t k = 0; k < std::size(roles); ++k) {
    CameraCalibration& camera = part.values.camera(part.camera(roles[k]).name);
    std::vector<double> sigma;
    const auto add = [&](const char* number) {
      const Estimate* const e = found.parameter(part.camera(roles[k]).name + " " + number);
      sigma.push_back(e ? e->sigma : 0);
    };
    std::for_each_n(kCameraParameterNames.begin(), kLensNumbers.size(), add);
    if (found.boards.cameras[k].port) std::for_each(kPortParameterNames.begin(), kPortParameterNames.end(), add);
    const double rms = camera.lens->rms_px;
    camera.lens = {source, found.boards.cameras[k], std::move(sigma), rms, views};
    if (roles[k] != CameraRole::kRight)
      camera.mount = {source, calibrated_pose(found.bMk[k], found.mount_covariance[k])};
  }
  const std::string& mono = part.camera(CameraRole::kMono).name;
  const Estimate& delay = delay_of(found, mono);
  std::optional<CalibratedTime>& time = part.values.camera(mono).time;
  time = {source, time->offset + from_seconds(delay.value), from_seconds(delay.sigma)};
  part.values.stereo = {source, calibrated_pose(found.lMr, found.pair_covariance)};
  part.values.gripper = {source, calibrated_pose(found.eMg, found.gripper_covariance)};
  if (part.values.joints) {
    CalibratedJoints joints{source, {}, {}};
    for (std::size_t i = 0; i < joints.theta0.size(); ++i) {
      joints.theta0[i] = found.arm.dh[i].theta0;
      if (const Estimate* const e = found.parameter(fmt::format("{} zero", kJointNames[i]))) joints.sigma[i] = e->sigma;
    }
    part.values.joints = joints;
  }
  part.values.laser = {source, found.ePl, found.sigma_rad, found.sigma_m, found.rms};
}

}  // namespace

std::string size_in_words(const Discrepancy::Size& size) {
  return fmt::format("{:.2f} mm and {:.2f} mrad", 1e3 * size.moved, 1e3 * size.turned);
}

JointOutcome refine_jointly(const JointStep& step, const std::vector<CalibrationCheck>& checks, const fs::path& folder,
                            CalibrationPart& part) {
  JointOutcome out;
  out.checks = checks;
  try {
    out.solution = solve(step.problem);
  } catch (const InputError& e) {
    out.why = std::string("the steps' result is kept: ") + e.what();
    return out;
  }
  const JointSolution& found = *out.solution;
  const std::vector<CalibrationCheck> joint = checks_of(step, found, part);
  double worst = 0;
  for (const CalibrationCheck& by_steps : checks)
    for (const CalibrationCheck& by_all : joint) {
      if (by_all.name != by_steps.name || by_all.value / by_steps.value <= worst) continue;
      worst = by_all.value / by_steps.value;
      out.steps = by_steps, out.joint = by_all.value;
    }
  const std::string figure = fmt::format("{}: {:.4f} {}, by the steps {:.4f} {}", out.steps->name, out.joint,
                                         out.steps->unit, out.steps->value, out.steps->unit);
  const Discrepancy* const apart =
      !found.discrepancies.empty() && found.discrepancies[0].sigmas > kMostSigmas ? &found.discrepancies[0] : nullptr;
  out.taken = worst <= kNoWorse && !apart;
  if (apart)
    out.why = fmt::format("the steps' result is kept: {}, something has moved{} ({:.1f} sigmas)", apart->name,
                          apart->size ? " by " + size_in_words(*apart->size) : "", apart->sigmas);
  else
    out.why = fmt::format("{}; of what was held back it is worst for {}",
                          out.taken ? "taken" : "the steps' result is kept", figure);
  if (!out.taken) return out;
  const CalibrationSource source =
      CalibrationPart::source("joint refinement; held back: " + figure, folder, step.files);
  put(part, source, found, step.views);
  out.checks = joint;
  return out;
}

nlohmann::ordered_json joint_json(const JointOutcome& outcome) {
  nlohmann::ordered_json out{{"taken", outcome.taken}, {"why", outcome.why}};
  if (!outcome.solution) return out;
  out["figure"] = {{"name", outcome.steps->name},
                   {"unit", outcome.steps->unit},
                   {"steps", outcome.steps->value},
                   {"joint", outcome.joint}};
  out["laser_sigma_mm"] = 1e3 * outcome.solution->laser_sigma;
  out["stereo_sigma_mm"] = 1e3 * outcome.solution->stereo_sigma;
  for (const ErrorGroup& group : outcome.solution->groups)
    out["groups"].push_back({{"name", group.name},
                             {"measurements", group.measurements},
                             {"sigma", group.sigma},
                             {"unit", group.unit},
                             {"allowance", group.allowance}});
  using Json = nlohmann::ordered_json;
  for (const Discrepancy& d : outcome.solution->discrepancies)
    out["moves"].push_back({{"name", d.name},
                            {"sigmas", d.sigmas},
                            {"limit_sigmas", kMostSigmas},
                            {"mm", d.size ? Json(1e3 * d.size->moved) : Json()},
                            {"mrad", d.size ? Json(1e3 * d.size->turned) : Json()}});
  for (const Estimate& e : outcome.solution->parameters)
    out["parameters"].push_back(
        {{"name", e.name}, {"unit", e.unit}, {"value", e.value}, {"sigma", e.sigma}, {"effect_mm", 1e3 * e.effect}});
  return out;
}

}  // namespace tankrig::app
