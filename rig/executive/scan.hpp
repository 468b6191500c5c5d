// A scan from power-on to parked: drives the cycle, feeds the cameras' frames and the joints to the session.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/laser/laser.hpp"
#include "rig/executive/scan_plan.hpp"
#include "rig/executive/scan_sink.hpp"

namespace tankrig {

struct ScanCamera {
  Camera* camera = nullptr;
  RecordWhen record = RecordWhen::kAll;
};

struct ScanProgress {
  double fraction = 0;  ///< of the plan's time, [0, 1]
  Phase phase = Phase::kMove;
  std::string segment;  ///< its name
};

/// Everything a scan needs; nothing is owned.
struct ScanJob {
  const ScanPlan& plan;
  const ScanSettings& settings;
  Clock& clock;
  Arm& arm;
  Laser& laser;
  std::vector<ScanCamera> cameras;  ///< the first that records the sweep sets the plan's frame grid
  ScanSink& sink;
  const std::atomic<bool>& stop;  ///< set by Ctrl-C: laser off, then arm stopped, session readable
  std::function<void(const ScanProgress&)> progress = {};  ///< ten times per second of the plan
};

struct ScanResult {
  std::string status;  ///< "complete" or "stopped: REASON", as in SessionInfo::status
  double simulated_s = 0;
  std::map<std::string, std::uint64_t>
      counts;                      ///< "CAMERA.REASON", "CAMERA.recorded", "cycle.overruns", "cycle.records_dropped"
  double max_following_error = 0;  ///< [rad]
  Duration worst_residual{};

  bool complete() const { return status == "complete"; }
};

/// Reads joints until the arm has told its posture once: what a plan starts from.
/// Errors: InputError after `timeout`, or with the driver's failure.
JointVector read_posture(Arm& arm, Clock& clock, Duration timeout);

/// Runs the plan. Under a VirtualClock single-threaded and bit-reproducible; under a MonotonicClock in real time.
/// However it ends - plan done, stop asked for, fault, exception of the sink - the laser is off first, then the arm
/// stopped. Errors: rethrows what the sink or the progress callback throws. A failing device is no exception but a
/// status.
ScanResult run_scan(ScanJob& job);

}  // namespace tankrig
