// `tankrig budget`: what each uncertainty of a rig costs in millimetres on its target.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/measuring_rig.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "calibration/budget/error_budget.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {
namespace {

struct BudgetOptions {
  std::string rig = "tank-sim";
  std::filesystem::path calibration;
  bool nominal = false, json = false;
};

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
  if (options.nominal) drawn = load_drawn_rig(file);
  if (drawn && !rig.calibration)
    throw InputError(file, "--nominal: the rig file names no calibration, expected --calibration FILE");
  for (const std::string& warning : calibration_warnings(rig)) progress.warn(warning);
  const Budget result = drawn ? budget_of_drawings(rig, *drawn) : budget_of(rig);
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
