// A scan from power-on to parked: drives the cycle, feeds the cameras' frames and the joints to the session.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "core/clock.hpp"
#include "core/cycle_times.hpp"
#include "core/wake_up_counts.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/capture/scan_sink.hpp"
#include "rig/executive/safe_end.hpp"
#include "rig/plan/scan_plan.hpp"
#include "rig/platform/real_time.hpp"
#include "rig/scan/camera_feeds.hpp"
#include "session/reading/frame_account.hpp"

namespace tankrig {

class StepWatch;

struct ScanProgress {
  double fraction = 0;  ///< of the plan's time, [0, 1]
  Phase phase = Phase::kMove;
  std::string segment;              ///< its name
  std::optional<JointVector> q;     ///< the newest joints; none before the arm has said them
  std::optional<LaserState> laser;  ///< the newest that it said
  double current_a = 0;             ///< of the arm's supply, with `q`
  bool armed = false;               ///< the safety step's
  bool interlock_closed = false;    ///< as the backend reads it
  std::optional<bool> box_enabled;  ///< the watchdog box's enable input; none: there is none
  double lit_s = 0;                 ///< how long the laser has emitted so far
  std::vector<CameraProgress> cameras;
  std::optional<WakeUpCounts::Seen> wake_ups;  ///< in real time only
  std::uint64_t overruns = 0;                  ///< of the cycle
};

struct ScanResult {
  std::string status;  ///< "complete" or "stopped: REASON", as in SessionInfo::status
  double simulated_s = 0;
  std::map<std::string, std::uint64_t>
      counts;  ///< "CAMERA.REASON", "CAMERA.recorded", "cycle.overruns", "cycle.records_dropped"
  std::map<std::string, CameraAccount> account;  ///< by camera, up to the sink: there, all count as recorded
  double max_following_error = 0;                ///< [rad]
  Duration worst_residual{}, residual_p99{};     ///< of the recorded frames
  Statistics sync;                               ///< "sync.residual_p50_ms" to "sync.residual_max_mm", and triggers
  EndState left;                                 ///< confirmed after the end
  std::optional<CycleTimes> times;               ///< in real time only
  RealTimeGrant granted;                         ///< in real time only

  bool complete() const { return status == "complete"; }
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
  const std::atomic<bool>& stop;           ///< set by Ctrl-C: laser off, then arm stopped; the session stays readable
  std::function<bool()> interlock_closed;  ///< the laser's interlock as the backend reads it; empty is open
  std::function<void(const ScanProgress&)> progress = {};  ///< ten times per second of the plan
  /// Reports what people must cut, at once and whenever it changes: a stop that is not taken, a device that does not
  /// answer, a cycle that hangs. Empty: laser off and arm at rest are now confirmed.
  /// Must return fast and not throw.
  std::function<void(const std::string& what)> cut = {};
  /// Is told of every safety step, from the first until laser off and arm at rest are confirmed.
  StepWatch* step_watch = nullptr;
  WatchdogBox* box = nullptr;  ///< watches every completed step; null: the rig has none
  /// Filled in even if run_scan throws. The status is empty if the scan was refused and nothing was touched.
  ScanResult result{};
};

/// Runs the plan, once the rig's watchdog box, if there is one, is enabled. A plan without laser never arms it and ignores its interlock. Single-threaded and bit-reproducible
/// under a VirtualClock; in real time under a MonotonicClock.
/// However it ends (plan done, stop, fault, exception of the sink), the laser is commanded off first, then the arm to
/// rest, in every cycle until both are confirmed or rest_timeout has passed. A cycle that hangs in real time is noticed
/// after heartbeat_timeout, and the same is done past it. After another rest_timeout it is left behind: then nothing is
/// confirmed, and clock, devices and `stop` must live as long as the program (Cycle::any_left_behind()).
/// Errors: those of check_box_open, check_laser_ready, check_light, check_witness and, in real time, check_real_time. Rethrows what the
/// sink or the progress callback throws, after an event if the sink still takes one. A failing device gives a status,
/// not an exception.
ScanResult run_scan(ScanJob& job);

}  // namespace tankrig
