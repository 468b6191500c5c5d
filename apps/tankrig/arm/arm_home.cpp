// `tankrig arm home`: the zero of relative encoders, found in the joints' stops.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/start_warning.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "rig/executive/homing.hpp"

namespace tankrig::app {
namespace {

/// Homing has no cycle: its guardian waits for as long as the arm's driver waits for one that hangs, or longer.
constexpr Duration kGuarded = std::chrono::milliseconds{250};

HomingResult home(Arm5e& arm, Backend& backend, const ScanSettings& settings, Progress& progress) {
  if (StepWatch* const watch = backend.step_watch())
    watch->begin(std::max(kGuarded, from_seconds(settings.safety.guardian_timeout)));
  return home_axes({arm, backend.laser(), backend.clock(), settings, StopOnSignal::requested(),
                    [&] { return backend.interlock_closed(); },
                    [&](const HomingProgress& p) {
                      if (p.phase == HomingProgress::Phase::kWaitingForBox) {
                        progress.update("waiting for the watchdog box: press its button", 0);
                        return;
                      }
                      const bool done = p.phase == HomingProgress::Phase::kDone;
                      progress.update(std::string("arm: home ") + kJointNames[p.joint],
                                      (static_cast<int>(p.joint) + (done ? 1.0 : 0.5)) / kJoints);
                    },
                    backend.box(), backend.step_watch()});
}

/// A zero that is not where the arm was left: no fault, for an arm without supply may be moved by hand.
void tell_moved(const HomingResult& result, int agreement_ticks, Progress& progress) {
  for (std::size_t j = 0; j < kJoints; ++j)
    if (result.axes[j] && std::abs(result.axes[j]->from_expected_ticks.value_or(0)) > agreement_ticks)
      progress.warn(
          fmt::format("arm: {} is {} ticks from where the last program left it: moved without supply, or its "
                      "stop is not where it was",
                      kJointNames[j], *result.axes[j]->from_expected_ticks));
}

nlohmann::ordered_json json_of(const HomingResult& result, const EndState& left) {
  nlohmann::ordered_json out;
  out["status"] = result.message();
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (!result.axes[j]) continue;
    const HomedAxis& axis = *result.axes[j];
    out["joints"].push_back(
        {{"name", kJointNames[j]},
         {"angle_at_stop_deg", to_degrees(axis.angle_at_stop)},
         {"raw_at_stop", axis.raw_at_stop},
         {"raw_at_zero", axis.raw_at_zero},
         {"fast_stop_ticks", axis.fast_stop_ticks},
         {"from_expected_ticks",
          axis.from_expected_ticks ? nlohmann::ordered_json(*axis.from_expected_ticks) : nlohmann::ordered_json()},
         {"current_a", axis.current_a}});
  }
  out["laser_dark"] = left.laser_dark;
  out["arm_at_rest"] = left.arm_at_rest;
  return out;
}

void print(const HomingResult& result) {
  std::printf("%-12s %14s %12s %12s %10s\n", "joint", "angle at stop", "raw at stop", "raw at zero", "current");
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (!result.axes[j]) continue;
    const HomedAxis& axis = *result.axes[j];
    std::printf("%-12s %10.2f deg %12u %12u %8.2f A\n", kJointNames[j], to_degrees(axis.angle_at_stop),
                unsigned{axis.raw_at_stop}, unsigned{axis.raw_at_zero}, axis.current_a);
  }
}

/// Errors: InputError with what was left.
void keep(const std::filesystem::path& zero_file, const ArmZero& zero, const EndState& left, Progress& progress) {
  if (zero_file.empty()) {
    progress.warn("the zero is known to this program only: the rig file names no devices: arm: zero_file");
    return;
  }
  try {
    save_arm_zero(zero_file, zero);
  } catch (const InputError& e) {
    throw InputError(std::string("arm homed, but its zero is not kept: ") + e.what() + "; " + to_string(left));
  }
  progress.note("zero kept in " + zero_file.string() + (left.safe() ? "; " + to_string(left) : ""));
}

}  // namespace

int arm_home(const ArmCommandOptions& options) {
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig));
  const StopOnSignal stop_on_signal;  // before the devices: it outlives them
  const OwnBackend backend =
      make_backend(rig, {.carrier = options.carrier, .need = {.cameras = false}, .command = "arm home"});
  Arm5e* const arm = backend->homed_arm();
  if (!arm) {
    if (options.json)
      print_json({{"status", "not needed"}});
    else
      std::printf("the arm of %s needs no homing: its encoders know their zero\n", rig.name.c_str());
    return kOk;
  }
  const std::filesystem::path zero_file = arm->settings().zero_file;
  if (const auto folder = std::filesystem::absolute(zero_file).parent_path();
      !zero_file.empty() && ::access(folder.c_str(), W_OK) != 0)
    throw InputError(zero_file,
                     "cannot be written: " + std::string(std::strerror(errno)) + ", expected a folder for it");
  const StartWarning warning(rig, *backend,
                             "its arm will move every joint into its stop, without a check for obstacles", options.yes,
                             progress);
  const RigStops stops(*backend, progress);
  make_laser_dark(*backend, rig.scan);
  Motion motion(*backend, rig.scan.safety, progress);

  const HomingResult result = home(*arm, *backend, rig.scan, progress);
  const auto laser = backend->laser().state();
  const EndState left = motion.look(laser.ok() && laser.value().dark());
  progress.finish_line();
  if (options.json)
    print_json(json_of(result, left));
  else
    print(result);
  if (!result.ok()) {
    progress.warn("arm not homed: " + result.message() + "; " + to_string(left));
    return StopOnSignal::requested() && left.safe() ? kPartial : kFailure;
  }
  tell_moved(result, arm->settings().homing.agreement_ticks, progress);
  keep(zero_file, result.zero(), left, progress);
  motion.end();
  if (left.safe()) return kOk;
  progress.warn("arm homed, but not confirmed safe afterwards: " + to_string(left) +
                (left.arm_at_rest ? "" : ", then home again"));
  return kFailure;
}

}  // namespace tankrig::app
