#include "apps/tankrig/bench/bench_run.hpp"

#include <fmt/format.h>

#include "apps/tankrig/session/open_session.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {

BenchRun::BenchRun(Benchmark benchmark, RigConfig rig, const sim::WorldOptions& world, Progress& progress)
    : rig_(std::move(rig)), progress_(progress), evaluation_(std::move(benchmark), rig_, world) {
  open_recording();
  if (!recording_ && rig_.backend != "mock")
    throw InputError(rig_.file,
                     "backend: found '" + rig_.backend +
                         "', expected mock: tankrig bench runs on a simulated rig, tankrig experiment on any");
  refuse_updaters();
  const auto first = scan(condition(0));
  refuse_updaters_of(*first);
  evaluation_.refuse_measures(first->trace());
  evaluation_.identity()["calibration_sha256"] = first->recorded().info.calibration_hash;
}

void BenchRun::open_recording() {
  for (const Updater& updater : benchmark().updaters) {
    if (updater.kind != UpdaterKind::kBagFog) continue;
    const fs::path folder = fs::absolute(benchmark().file).parent_path() / evaluation_.names().of(updater.bag);
    std::error_code ignored;
    if (!fs::exists(folder / "session.yaml", ignored)) continue;
    OpenedSession opened = open_with_warnings(session_path(folder), progress_);
    if (opened.session.info.rig != rig_.name)
      throw InputError(folder, "was recorded by the rig '" + opened.session.info.rig + "', expected --rig " +
                                   opened.session.info.rig + ", found " + rig_.name);
    if (!opened.session.info.object) throw InputError(folder, "has no object to score against, expected a scan");
    evaluation_.identity()["session_sha256"] = sha256_of_text(read_whole_file(folder / "session.yaml"));
    recording_ = std::make_shared<const SessionScan>(std::move(opened), rig_);
    recording_line_ = updater.line;
    return;
  }
}

void BenchRun::refuse_updaters() {
  evaluation_.leave_out_loops([&](const Updater& updater) -> std::string {
    if (updater.kind == UpdaterKind::kBagFog && updater.line != recording_line_)
      return recording_ ? "found a second recording, expected one"
                        : "found no session '" + updater.bag +
                              "', expected the folder of a recorded one: the pictures of a bag have no joints to "
                              "reconstruct with";
    const bool of_pictures = updater.kind != UpdaterKind::kBagFog && updater.kind != UpdaterKind::kAlgorithm &&
                             updater.kind != UpdaterKind::kCalibrationError;
    if (recording_ && of_pictures) return "its pictures are recorded: fog alone is added to them";
    return evaluation_.unknown_name(updater);
  });
  for (const Updater& updater : benchmark().updaters)
    if (updater.kind == UpdaterKind::kCurrent)
      evaluation_.refuse(updater,
                         "no force moves '" + updater.target +
                             "' on a fixed rig: the current drifts the water's particles, steadily, without swing");
}

void BenchRun::refuse_updaters_of(const MeasuredScan& scan) {
  const auto* const layers = dynamic_cast<const LayeredScan*>(&scan);
  evaluation_.leave_out_loops([&](const Updater& updater) -> std::string {
    if (updater.kind == UpdaterKind::kCalibrationError &&
        !has_target(scan.recorded().info, evaluation_.names().of(updater.target)))
      return "this rig has no '" + updater.target + "' with a pose, expected laser or a camera";
    if (updater.kind == UpdaterKind::kLux && layers && updater.highest() > layers->most_lux())
      return fmt::format("found {:g} lx, expected at most {:g}: what the lux meter reads in this scene's light at 1",
                         updater.highest(), layers->most_lux());
    return "";
  });
}

RigConfig BenchRun::changed_rig(const Condition& condition) const {
  RigConfig rig = rig_;
  if (condition.sweep_velocity) rig.scan.sweep.velocity = *condition.sweep_velocity;
  if (condition.posture) {
    const double elbow = rig.scan.posture[2];  // where the sweep begins
    rig.scan.posture = *condition.posture;
    rig.scan.posture[2] = elbow;
  }
  return rig;
}

std::shared_ptr<const MeasuredScan> BenchRun::scan(const Condition& condition) {
  if (recording_) return recording_;
  return layered(condition);
}

std::shared_ptr<const LayeredScan> BenchRun::layered(const Condition& condition) {
  const std::lock_guard lock(mutex_);
  const std::string key = condition.scan_key();
  if (scan_ && key == key_) return scan_;
  scan_.reset();
  scan_ = std::make_shared<const LayeredScan>(changed_rig(condition), condition.world, progress_);
  key_ = key;
  return scan_;
}

}  // namespace tankrig::app
