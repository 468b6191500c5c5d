#include "rig/scan/scan_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "session/recording/event_kinds.hpp"

namespace tankrig {
namespace {

std::string describe(const CycleRecord& record, const ScanPlan& plan) {
  std::string text = to_string(record.fault);
  if (record.violation) {
    text += ": " + describe(*record.violation);
  } else if (record.fault == Fault::kBeamMissing || record.fault == Fault::kBeamStray) {
    text += std::string(": ") + record.error.where;  // no device failed
  } else if (record.error.where[0] != '\0') {
    text += ": " + describe(record.error);
  }
  return text + " in \"" + plan.segments()[record.segment].name + "\"";
}

}  // namespace

void ScanLog::add(const CycleRecord& r, const std::string& why) {
  const bool entered = r.state != last_.state;
  if (r.state == ExecutiveState::kRunning && (entered || r.segment != last_.segment))
    sink_.event(r.stamp, event_kind::kPhase, plan_.segments()[r.segment].name);
  if (r.armed != last_.armed) sink_.event(r.stamp, event_kind::kLaser, r.armed ? "armed" : "disarmed");
  if (r.holding && !last_.holding) sink_.event(r.stamp, event_kind::kLaser, "hold");
  if (r.laser_commanded != last_.laser_commanded)
    sink_.event(r.stamp, event_kind::kLaser, r.laser_commanded ? "on" : "off");
  if (r.laser && std::exchange(emitting_, r.laser->emitting) != r.laser->emitting)
    sink_.event(r.laser->since, event_kind::kLaser, r.laser->emitting ? std::string(kLaserEmitting) : kLaserDark);
  failed("laser not switched off: ", r.stamp, r.laser_off, last_.laser_off);
  failed("arm not stopped: ", r.stamp, r.arm_stop, last_.arm_stop);
  if (entered && r.state == ExecutiveState::kFault) {
    fault_ = describe(r, plan_);
    const bool of_a_helper = r.fault == Fault::kHeartbeat || r.fault == Fault::kThread;
    if (of_a_helper && !why.empty()) fault_ += "; " + why;
    sink_.event(r.stamp, event_kind::kFault, fault_);
  }
  if (entered && r.state == ExecutiveState::kStopped) {
    stop_ = why.empty() ? "asked for" : why;
    sink_.event(r.stamp, event_kind::kStop, stop_);
  }
  if (entered && r.state == ExecutiveState::kDone) sink_.event(r.stamp, event_kind::kPhase, "done");
  last_ = r;
}

/// Once for a run of failures: the executive tries again in every cycle.
void ScanLog::failed(const char* what, Stamp when, const Status& now, const Status& before) {
  if (!now.ok() && before.ok()) sink_.event(when, event_kind::kFault, what + describe(now.error()));
}

void ScanLog::summary(Stamp now, double max_following_error, Duration worst_residual, const EndState& left) {
  sink_.event(now, event_kind::kSummary, fmt::format("largest following error {:.5f} rad", max_following_error));
  sink_.event(now, event_kind::kSummary, fmt::format("largest sync residual {:.3f} ms", 1e3 * seconds(worst_residual)));
  sink_.event(now, left.safe() ? event_kind::kSummary : event_kind::kFault, to_string(left));
}

}  // namespace tankrig
