#include "apps/tankrig/bench/bench_run.hpp"

#include <fmt/format.h>

#include "core/input_error.hpp"

namespace tankrig::app {

BenchRun::BenchRun(Benchmark benchmark, RigConfig rig, const sim::WorldOptions& world, Progress& progress)
    : rig_(std::move(rig)), progress_(progress), evaluation_(std::move(benchmark), rig_, world) {
  if (rig_.backend != "mock")
    throw InputError(rig_.file,
                     "backend: found '" + rig_.backend +
                         "', expected mock: tankrig bench runs on a simulated rig, tankrig experiment on any");
  refuse_updaters();
  const auto first = scan(condition(0));
  refuse_updaters_of(*first);
  evaluation_.refuse_measures(first->trace());
  evaluation_.identity()["calibration_sha256"] = first->recorded().info.calibration_hash;
}

void BenchRun::refuse_updaters() {
  evaluation_.leave_out_loops([&](const Updater& updater) -> std::string {
    if (updater.kind == UpdaterKind::kBagFog) return "a bag's pictures have no joints to scan with";
    return evaluation_.unknown_name(updater);
  });
  for (const Updater& updater : benchmark().updaters)
    if (updater.kind == UpdaterKind::kCurrent)
      evaluation_.refuse(updater,
                         "no force moves '" + updater.target +
                             "' on a fixed rig: the current drifts the water's particles, steadily, without swing");
}

void BenchRun::refuse_updaters_of(const LayeredScan& scan) {
  evaluation_.leave_out_loops([&](const Updater& updater) -> std::string {
    if (updater.kind == UpdaterKind::kCalibrationError &&
        !has_target(scan.recorded().info, evaluation_.names().of(updater.target)))
      return "this rig has no '" + updater.target + "' with a pose, expected laser or a camera";
    if (updater.kind == UpdaterKind::kLux && updater.highest() > scan.most_lux())
      return fmt::format("found {:g} lx, expected at most {:g}: what the lux meter reads in this scene's light at 1",
                         updater.highest(), scan.most_lux());
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

std::shared_ptr<const LayeredScan> BenchRun::scan(const Condition& condition) {
  const std::lock_guard lock(mutex_);
  const std::string key = condition.scan_key();
  if (scan_ && key == key_) return scan_;
  scan_.reset();
  scan_ = std::make_shared<const LayeredScan>(changed_rig(condition), condition.world, progress_);
  key_ = key;
  return scan_;
}

}  // namespace tankrig::app
