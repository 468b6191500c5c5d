// One scan of the simulated rig, kept in memory before its light and its noise: every point of a grid over both is made
// of it.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "bench/benchmark/run_trace.hpp"
#include "rig/config/rig_config.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

/// What the camera pictures of one configuration are made with; absent: the scene's own.
struct PictureConditions {
  std::optional<double> light, noise;
  std::optional<double> lux;  ///< in place of light: what the lux meter reads
};

/// The rig scans once, under its virtual clock, in the scene's own light: this scan's cameras check the laser. Of every
/// recorded frame the layers stay, of the pictures none.
/// Threads: const members from any number of threads.
class LayeredScan {
 public:
  /// Errors: InputError, also if the scan does not complete.
  LayeredScan(const RigConfig& rig, const sim::WorldOptions& world, Progress& progress);

  /// The session as a scan under these conditions records it, its pictures in memory: the same bits. `laser`, `stereo`:
  /// which cameras' pictures are wanted.
  Session session(const PictureConditions& conditions, bool laser, bool stereo) const;
  /// One picture of it.
  cv::Mat picture(const FrameRecord& frame, const PictureConditions& conditions) const;

  const RunTrace& trace() const { return trace_; }  ///< in the scene's own light
  /// What the lux meter reads under these conditions; the most, in the brightest light.
  double lux(const PictureConditions& conditions) const;
  double most_lux() const { return most_lux_; }
  const Session& recorded() const { return session_; }  ///< without pictures
  const std::vector<JointState>& joints() const { return joints_; }
  const std::string& rig_yaml() const { return rig_yaml_; }  ///< as a session keeps it
  double simulated_s() const { return session_.info.simulated_s; }

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
