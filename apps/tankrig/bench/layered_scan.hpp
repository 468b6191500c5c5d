// One scan of the simulated rig, kept in memory before its light and its noise: every point of a grid over both is made
// of it.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "apps/tankrig/bench/measured_scan.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "rig/config/rig_config.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

/// The rig scans once, under its virtual clock, in the scene's own light: this scan's cameras check the laser. Of every
/// recorded frame the layers stay, of the pictures none.
/// Threads: const members from any number of threads.
class LayeredScan final : public MeasuredScan {
 public:
  /// Errors: InputError, also if the scan does not complete.
  LayeredScan(const RigConfig& rig, const sim::WorldOptions& world, Progress& progress);

  /// As a scan under these conditions records it, its pictures in memory: the same bits.
  cv::Mat picture(const FrameRecord& frame, const PictureConditions& conditions) const override;
  const Session& recorded() const override { return session_; }
  const RunTrace& trace() const override { return trace_; }  ///< in the scene's own light
  std::optional<double> lux(const PictureConditions& conditions) const override;
  const std::vector<JointState>& joints() const override { return joints_; }
  const std::string& rig_yaml() const override { return rig_yaml_; }

  double most_lux() const { return most_lux_; }  ///< what the lux meter reads in the brightest light

 private:
  double light(const PictureConditions& conditions) const;

  using FrameKey = std::pair<std::string, std::uint64_t>;  ///< camera, the device's number

  OwnBackend backend_;
  std::map<FrameKey, std::shared_ptr<const sim::FrameLayers>> layers_;
  Session session_;
  RunTrace trace_;
  double most_lux_ = 0;
  std::vector<JointState> joints_;
  std::string rig_yaml_;
};

}  // namespace tankrig::app
