// A recorded session as a scan that a benchmark measures.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/bench/measured_scan.hpp"
#include "rig/config/rig_config.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

class SessionScan final : public MeasuredScan {
 public:
  /// `rig`: what recorded it.
  /// Errors: InputError, where its tables are not whole.
  SessionScan(OpenedSession opened, const RigConfig& rig);

  /// As it was recorded, in fog if the conditions have one; light and noise are the recording's own.
  Session session(const PictureConditions& conditions, bool laser, bool stereo) const override;
  cv::Mat picture(const FrameRecord& frame, const PictureConditions& conditions) const override;
  const Session& recorded() const override { return opened_.session; }
  const RunTrace& trace() const override { return trace_; }
  std::optional<double> lux(const PictureConditions& conditions) const override;
  const std::vector<JointState>& joints() const override { return opened_.joints; }
  const std::string& rig_yaml() const override { return rig_yaml_; }

 private:
  OpenedSession opened_;
  RunTrace trace_;
  std::string rig_yaml_;
};

/// The mean of the readings before and after the sweep.
std::optional<double> mean_lux(const SessionInfo& info);

}  // namespace tankrig::app
