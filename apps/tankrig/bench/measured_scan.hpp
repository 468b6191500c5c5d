// A scan that a benchmark's measures look at: kept in layers, or a session on disk.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/bench/condition.hpp"
#include "bench/benchmark/run_trace.hpp"
#include "bench/metrics/ceiling.hpp"
#include "bench/metrics/metrics.hpp"
#include "core/joint_state.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

/// Threads: const members from any number of threads.
class MeasuredScan {
 public:
  virtual ~MeasuredScan() = default;
  MeasuredScan(const MeasuredScan&) = delete;
  MeasuredScan& operator=(const MeasuredScan&) = delete;

  /// The session under these conditions, its pictures in memory. `laser`, `stereo`: which cameras' pictures are wanted.
  virtual Session session(const PictureConditions& conditions, bool laser, bool stereo) const;
  /// One picture of it.
  virtual cv::Mat picture(const FrameRecord& frame, const PictureConditions& conditions) const = 0;
  virtual const Session& recorded() const = 0;  ///< its pictures may be missing
  virtual const RunTrace& trace() const = 0;
  /// What the lux meter reads under these conditions, if there is one.
  virtual std::optional<double> lux(const PictureConditions& conditions) const = 0;
  virtual const std::vector<JointState>& joints() const = 0;
  virtual const std::string& rig_yaml() const = 0;  ///< as a session keeps it

  /// session_ceiling(), computed once for each `eyes`: "laser", "stereo", or one of our methods.
  Ceiling ceiling(const ObjectSurface& object, const std::string& eyes, const MetricThresholds& thresholds) const;

 protected:
  MeasuredScan() = default;

 private:
  mutable std::mutex mutex_;  // guards what follows
  mutable std::map<std::string, Ceiling> ceilings_;
};

}  // namespace tankrig::app
