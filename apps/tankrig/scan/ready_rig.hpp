// What stands between a rig and its first motion: its devices, where the arm is, the checks, the operator's word.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/start_warning.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "apps/tankrig/scan/record_session.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// A rig that may move and shine once it is made, and a plan that was checked on it. Where it ends, so does that.
class ReadyRig {
 public:
  using PlanFrom = std::function<ScanPlan(const JointVector& posture)>;

  /// `session`: the folder that is to be made.
  /// Errors: InputError if anything speaks against the plan, StoppedEarly; nothing has moved then.
  ReadyRig(const ScanOptions& options, const RigConfig& rig, const std::filesystem::path& session,
           const PlanFrom& plan_from, Progress& progress);

  Backend& backend() { return *backend_; }
  const ScanPlan& plan() const { return *plan_; }
  Motion& motion() { return *motion_; }
  const std::string& commission() const { return commission_; }  ///< SessionInfo::commission
  /// The motion is over: no stop key, no lamp.
  void disarm();

 private:
  const std::string commission_;
  StopOnSignal stop_on_signal_;  // before the devices: it outlives them
  OwnBackend backend_;
  std::optional<ScanPlan> plan_;
  std::optional<StartWarning> warning_;
  std::unique_ptr<RigStops> stops_;
  std::optional<Motion> motion_;
};

}  // namespace tankrig::app
