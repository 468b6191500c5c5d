// The cycle: read joints, decide safety, follow the plan, schedule the laser, write set-points, leave a record.
#pragma once

#include <atomic>
#include <limits>
#include <optional>

#include "core/spsc_ring.hpp"
#include "core/suspend_watch.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/executive/cycle_listener.hpp"
#include "rig/executive/cycle_record.hpp"
#include "rig/executive/joint_follower.hpp"
#include "rig/plan/scan_plan.hpp"
#include "rig/safety/guarded_outputs.hpp"
#include "rig/safety/joint_monitor.hpp"
#include "rig/safety/laser_watch.hpp"
#include "rig/safety/rest_watch.hpp"
#include "rig/safety/step_watch.hpp"

namespace tankrig {

/// Owns arm and laser while it lives. Others use its switches and its ring.
/// Threads: step() in the cycle's thread, everything else in one other.
/// RT: step is safe: it never allocates, blocks or throws.
class Executive {
 public:
  /// `ring_capacity` cycle records may wait to be read.
  Executive(const ScanPlan& plan, const ScanSettings& settings, Arm& arm, Laser& laser,
            std::size_t ring_capacity = 1024);

  /// One cycle at `now`, when the machine has been `asleep` for this long.
  void step(Stamp now, const TimeAsleep& asleep = {}) noexcept;

  /// The plan's time 0; it must lie in the future. Until then the arm rests. If the plan does not begin at the arm's
  /// measured posture, that is a following error before anything moves.
  void start(Stamp plan_zero) noexcept { plan_zero_ns_.store(plan_zero.ns, std::memory_order_release); }

  // Switches of the safety step; all off until they are set.
  void set_armed(bool on) noexcept { armed_.store(on, std::memory_order_relaxed); }
  void set_interlock(bool closed) noexcept { interlock_.store(closed, std::memory_order_relaxed); }
  /// The supervisor was well at `when`.
  void heartbeat(Stamp when) noexcept { heartbeat_ns_.store(when.ns, std::memory_order_relaxed); }
  /// Laser off, then arm stopped, in the next cycle, for good.
  void request_stop() noexcept { stop_.store(true, std::memory_order_relaxed); }
  /// The same while `flag` is set by anyone: no supervisor has to pass it on. Call before the first cycle.
  void stop_also_on(const std::atomic<bool>& flag) noexcept { outside_stop_ = &flag; }
  /// If the cycle hangs: laser off, then arm stopped, past it. The cycle stops if it goes on.
  void stop_past_cycle() noexcept {
    request_stop();
    guard_.force_safe_past_cycle();
  }
  /// `box` hears of every completed step. Without its word nothing moves or shines. It outlives the executive. Call
  /// before the first cycle.
  void watch_by(WatchdogBox* box) noexcept {
    box_ = box;
    guard_.tell(watch_, box_);
  }
  /// What the cameras say of the beam.
  /// Threads: any.
  void set_beam(BeamVerdict verdict) noexcept { beam_.store(verdict, std::memory_order_relaxed); }
  /// A thread that the rig depends on has died; for good.
  /// Threads: any.
  void thread_died() noexcept { thread_died_.store(true, std::memory_order_relaxed); }
  /// The cycle was late too often: the next one faults.
  /// Threads: any.
  void too_many_overruns() noexcept { overrun_.store(true, std::memory_order_relaxed); }

  /// `listener` hears every cycle and outlives the executive. Call before the first cycle.
  void set_listener(CycleListener* listener) noexcept { listener_ = listener; }

  /// `watch` is told of every completed step, and its objection is a fault. Outlives the executive. Call before the
  /// first cycle.
  void set_step_watch(StepWatch* watch) noexcept {
    watch_ = watch;
    guard_.tell(watch_, box_);
  }

  /// When the newest joint state was read; zero before the first.
  /// Threads: the cycle's.
  Stamp newest_joints() const noexcept { return joints_ ? joints_->stamp : Stamp{}; }

  /// Oldest record not yet read.
  bool try_pop(CycleRecord& record) noexcept { return ring_.try_pop(record); }
  std::uint64_t records_dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::int64_t kNotStarted = std::numeric_limits<std::int64_t>::max();

  void read_joints(CycleRecord& record) noexcept;
  void read_laser(CycleRecord& record) noexcept;
  void check_following(CycleRecord& record) noexcept;
  void check_silence(const CycleRecord& record) noexcept;
  InterlockOutputs decide(const CycleRecord& record) noexcept;
  bool laser_request(const CycleRecord& record, const Segment& segment) const noexcept;
  JointVector follow(const CycleRecord& record) noexcept;
  void act(CycleRecord& record, const InterlockOutputs& allowed) noexcept;
  void write_outputs(CycleRecord& record) noexcept;
  void force_safe(CycleRecord& record) noexcept;
  void raise(Fault fault, const Error& error = {}) noexcept;
  void raise(const JointMonitor::Answer& violation, Stamp now) noexcept;
  void raise(Trip trip, BeamVerdict beam, Stamp now) noexcept;
  bool stop_asked() const noexcept {
    return stop_.load(std::memory_order_relaxed) || (outside_stop_ && outside_stop_->load(std::memory_order_relaxed));
  }

  const ScanPlan& plan_;
  const ScanSettings settings_;
  GuardedOutputs guard_;
  RestWatch rest_;
  LaserWatch laser_watch_;
  JointFollower follower_;
  JointMonitor monitor_;
  SuspendWatch suspend_watch_;
  SpscRing<CycleRecord> ring_;

  std::atomic<std::int64_t> plan_zero_ns_{kNotStarted};
  std::atomic<std::int64_t> heartbeat_ns_{0};
  std::atomic<bool> armed_{false}, interlock_{false}, stop_{false}, overrun_{false}, thread_died_{false};
  std::atomic<BeamVerdict> beam_{BeamVerdict::kNone};
  const std::atomic<bool>* outside_stop_ = nullptr;
  CycleListener* listener_ = nullptr;
  StepWatch* watch_ = nullptr;
  WatchdogBox* box_ = nullptr;
  std::atomic<std::uint64_t> dropped_{0};

  // The cycle's own.
  std::uint64_t cycle_ = 0;
  ExecutiveState state_ = ExecutiveState::kWaiting;
  Fault fault_ = Fault::kNone;
  Error error_{};
  std::optional<JointViolation> violation_;
  bool raised_ = false;               // a fault since the last decision
  bool slept_ = false;                // since the step before
  std::optional<JointState> joints_;  // newest
  Stamp last_news_{};
  Stamp last_step_{};
  bool loop_closed_ = true;  // the interlock's, as the laser's device reads it where it does
};

}  // namespace tankrig
