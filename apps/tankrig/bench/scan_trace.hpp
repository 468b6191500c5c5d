// What happened in a scan, for the triggers and measures of a benchmark.
#pragma once

#include <optional>
#include <vector>

#include "bench/benchmark/run_trace.hpp"
#include "core/joint_state.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/plan/scan_plan.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

/// What a scan of the rig can be asked about, before there is one: bodies, cameras, streams; no samples.
RunTrace trace_of_rig(const RigConfig& rig, const std::vector<CalibratedCamera>& cameras, std::optional<double> lux);

/// `plan_begin`: when the plan's clock was at zero. `joints`: of the scan, at least one.
RunTrace trace_of_scan(const RigConfig& rig, const ScanPlan& plan, Stamp plan_begin,
                       const std::vector<JointState>& joints, const Session& session, std::optional<double> lux);

}  // namespace tankrig::app
