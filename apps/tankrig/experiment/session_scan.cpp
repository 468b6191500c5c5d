#include "apps/tankrig/experiment/session_scan.hpp"

#include "apps/tankrig/bench/scan_trace.hpp"
#include "core/text_files.hpp"
#include "rig/scan/replay.hpp"

namespace tankrig::app {

std::optional<double> mean_lux(const SessionInfo& info) {
  if (!info.lux_before) return std::nullopt;
  return (*info.lux_before + info.lux_after.value_or(*info.lux_before)) / 2;
}

SessionScan::SessionScan(OpenedSession opened, const RigConfig& rig) : opened_(std::move(opened)) {
  const RecordedScan scan = read_recorded_scan(opened_.session);
  trace_ = trace_of_scan(rig, scan.plan, scan.plan_zero, scan.joints, opened_.session, mean_lux(opened_.session.info));
  rig_yaml_ = read_whole_file(opened_.session.path / "rig.yaml");
}

Session SessionScan::session(const PictureConditions&, bool, bool) const { return opened_.session; }

std::optional<double> SessionScan::lux(const PictureConditions&) const { return mean_lux(opened_.session.info); }

}  // namespace tankrig::app
