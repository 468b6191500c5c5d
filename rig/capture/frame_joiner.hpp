// Every frame of a scan is joined to the joints at its mid-exposure and recorded, or counted with a reason.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "rig/capture/laser_timeline.hpp"
#include "rig/capture/scan_sink.hpp"
#include "rig/plan/scan_plan.hpp"
#include "rig/sync/joint_history.hpp"

namespace tankrig {

/// Joint samples kept for frames still to be joined.
constexpr std::size_t kJointSamples = 4096;

/// Reasons, as counted under "CAMERA.REASON":
///   silent           the camera was silent when the frame was due, by its rate
///   not_recorded     taken outside what this camera records, or beyond the dark block's number
///   joints_before    older than every joint sample kept
///   joints_after     the scan ended before a joint sample came
///   joint_gap        the joint samples around it are too far apart
///   laser_switching  the laser went on or off while it was exposed
///   laser_wrong      sweep frame without laser, or dark frame with it
///   laser_unknown    the scan ended before the laser's state at that time was known
///   sync_gate        its joints are known less well than the rig file allows (rig/sync/sync_gate.hpp)
///   recorder_failed  it could be joined, but nothing could be recorded any more
/// Threads: one.
/// RT: never.
class FrameJoiner {
 public:
  FrameJoiner(const ScanPlan& plan, const ScanSettings& settings, const JointHistory& joints,
              const LaserTimeline& laser, ScanSink& sink);

  /// Frames stamped before this are not recorded; without it none are.
  void start(Stamp plan_zero) { plan_zero_ = plan_zero; }
  /// Registers a camera; returns its number. Its frames are stamped on the joints' clock. `at_angles`: in sweeps it
  /// exposes only at angles of the recorded part, so every frame of a sweep is recorded, even if half of the first or
  /// last exposure lies outside.
  int add_camera(const std::string& name, RecordWhen record, bool at_angles = false);
  /// Whether this camera records a frame exposed somewhere in [begin, end].
  bool wanted(int camera, Stamp begin, Stamp end) const;

  void add(int camera, Frame frame);
  /// A free-running camera sent no frame between the exposure of `last` and `end`. Frames due in between, a `period`
  /// apart, are counted as silent if they would have been recorded, except `known` ones, which are counted elsewhere.
  /// Returns how many of those would have been recorded.
  std::uint64_t add_silence(int camera, const Frame& last, Duration period, Stamp end, std::uint64_t known);
  /// Records or counts the frames whose joints are known by now, in order of arrival.
  void drain();
  /// Counts the frames that still wait for joints.
  void finish();
  /// The same without telling the sink, which takes nothing any more.
  void give_up();

  /// Frames not used, by reason; also "CAMERA.recorded".
  const std::map<std::string, std::uint64_t>& counts() const { return counts_; }
  /// The sync residual that this share of the recorded frames does not exceed; share 1: the largest.
  Duration residual(double share) const;
  /// The same for the residual on the target [m].
  double residual_on_target(double share) const;
  /// The same for the standard deviation of their stamps.
  Duration stamp_sigma(double share) const;

 private:
  struct PerCamera {
    std::string name;
    RecordWhen record = RecordWhen::kAll;
    bool at_angles = false;
    int index = 0;
    std::vector<int> per_segment;
  };
  struct Waiting {
    int camera;
    Frame frame;
  };

  bool records(const PerCamera& camera, const Segment& segment) const;
  const Segment* segment_of(const PerCamera& camera, const Frame& frame) const;
  bool try_join(const Waiting& waiting);
  const char* why_waiting(const Waiting& waiting) const;
  bool passes_gate(const PerCamera& camera, const FrameRecord& record, double speed_on_target);
  void not_used(const PerCamera& camera, const char* reason, Stamp when);

  const ScanPlan& plan_;
  const ScanSettings settings_;
  const JointHistory& joints_;
  const LaserTimeline& laser_;
  ScanSink& sink_;
  std::optional<Stamp> plan_zero_;
  std::vector<PerCamera> cameras_;
  std::deque<Waiting> waiting_;
  std::map<std::string, std::uint64_t> counts_;
  std::vector<Duration> residuals_, stamp_sigmas_;
  std::vector<double> residuals_on_target_;
};

}  // namespace tankrig
