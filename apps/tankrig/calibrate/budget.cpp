// `tankrig budget`: what each uncertainty of a rig costs in millimetres on its target.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "bench/metrics/surface_samples.hpp"
#include "bench/metrics/triangle_mesh.hpp"
#include "calibration/budget/error_budget.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {
namespace {

struct BudgetOptions {
  std::string rig = "tank-sim";
  std::filesystem::path calibration;
  bool nominal = false, json = false;
};

BudgetCamera camera_of(const RigCamera& camera) { return {camera.name, camera.model, camera.bMc}; }

MeasuringRig measuring_rig(const RigConfig& rig) {
  MeasuringRig measuring;
  measuring.mono = camera_of(*rig.find_camera(CameraRole::kMono));
  const RigCamera *left = rig.find_camera(CameraRole::kLeft), *right = rig.find_camera(CameraRole::kRight);
  if (left && right) measuring.left = camera_of(*left), measuring.right = camera_of(*right);
  measuring.arm = rig.arm;
  measuring.ePl = rig.laser.ePl;
  return measuring;
}

std::vector<BudgetTarget> targets_of(const RigConfig& rig) {
  constexpr std::size_t kSamples = 500;
  std::vector<BudgetTarget> targets;
  const TriangleMesh mesh = read_mesh(rig.object.mesh);
  for (const SurfaceSample& sample : sample_surface(mesh, kSamples)) {
    const Eigen::Vector3i& t = mesh.triangles[sample.triangle];
    const Vector3d& a = mesh.vertices[t[0]];
    const Vector3d normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized();
    targets.push_back({rig.object.bMo * sample.p, rig.object.bMo.linear() * normal});
  }
  return targets;
}

nlohmann::ordered_json json_of(const Budget& budget) {
  const auto millimetres = [](const std::optional<double>& m) {
    return m ? nlohmann::ordered_json(1e3 * *m) : nlohmann::ordered_json();
  };
  nlohmann::ordered_json out{{"laser_mm", 1e3 * budget.laser},
                             {"stereo_mm", 1e3 * budget.stereo},
                             {"laser_samples", budget.laser_targets},
                             {"stereo_samples", budget.stereo_targets}};
  for (const BudgetLine& line : budget.lines)
    out["lines"].push_back({{"name", line.name},
                            {"size", line.sigma},
                            {"measured", line.measured},
                            {"laser_mm", millimetres(line.laser)},
                            {"stereo_mm", millimetres(line.stereo)}});
  return out;
}

void print(const Budget& budget, bool nominal) {
  const auto cell = [](const std::optional<double>& m) {
    return m ? fmt::format("{:.3f}", 1e3 * *m) : std::string("-");
  };
  const char* size = nominal ? "off by" : "one sigma";
  fmt::print("{:<26} {:<24} {:>10} {:>10}   mm off the surface, root mean square\n", "what", size, "laser", "stereo");
  for (const BudgetLine& line : budget.lines)
    fmt::print("{:<26} {:<24} {:>10} {:>10}\n", line.name, line.sigma + (line.measured ? "" : ", assumed"),
               cell(line.laser), cell(line.stereo));
  fmt::print("{:<26} {:<24} {:>10} {:>10}\n", "all together", "", cell(budget.laser), cell(budget.stereo));
  const auto first = [&](std::optional<double> BudgetLine::*method) {
    return *std::max_element(budget.lines.begin(), budget.lines.end(), [method](const auto& a, const auto& b) {
      return (a.*method).value_or(0) < (b.*method).value_or(0);
    });
  };
  const char* advice = nominal ? "most of the error comes from" : "improve first";
  if (budget.laser_targets > 0) fmt::print("laser: {}: {}\n", advice, first(&BudgetLine::laser).name);
  if (budget.stereo_targets > 0) fmt::print("stereo: {}: {}\n", advice, first(&BudgetLine::stereo).name);
}

int budget(const BudgetOptions& options) {
  Progress progress;
  const auto file = find_rig(options.rig);
  const RigConfig rig = load_rig(file, "", options.calibration);
  std::optional<RigConfig> drawn;
  if (options.nominal) drawn = load_rig(file);
  if (drawn && (!rig.calibration || drawn->calibration))
    throw InputError(file, "--nominal: expected --calibration FILE, and a rig file that names no calibration itself");
  for (const std::string& warning : calibration_warnings(rig)) progress.warn(warning);
  const BudgetSweep sweep{rig.scan.posture, rig.scan.sweep.from, rig.scan.sweep.to, rig.scan.sweep.velocity};
  const MeasuringRig measuring = measuring_rig(rig);
  std::array<double, kJoints> tick{};
  for (int joint = 0; joint < kJoints; ++joint)
    tick[static_cast<std::size_t>(joint)] =
        rig.arm.actuators[static_cast<std::size_t>(joint)].resolution(rig.scan.posture[joint]);
  std::vector<Uncertainty> uncertainties;
  if (drawn) {
    const double late =
        seconds(rig.find_camera(CameraRole::kMono)->time_offset - drawn->find_camera(CameraRole::kMono)->time_offset);
    uncertainties = differences_of(measuring, measuring_rig(*drawn), late, sweep);
  } else {
    uncertainties = uncertainties_of(measuring, rig.calibration ? &rig.calibration->values : nullptr, sweep, tick);
  }
  const Budget result = error_budget(measuring, sweep, targets_of(rig), uncertainties);
  progress.finish_line();
  if (options.json)
    print_json(json_of(result));
  else
    print(result, options.nominal);
  return kOk;
}

}  // namespace

void add_budget(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("budget", "What each uncertainty costs in millimetres, and what to improve first");
  BudgetOptions& o = options_of(c, chosen, &budget);
  c->footer(
      "Example: tankrig budget --rig tank-true --calibration calibration.yaml\n"
      "Sigmas are the calibration's; a rig without one gets those of a rig built by its drawings, marked as assumed.");
  add_rig_option(c, o.rig);
  add_calibration_option(c, o.calibration);
  c->add_flag("--nominal", o.nominal, "What the rig file's own values cost, compared with the calibration's");
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
