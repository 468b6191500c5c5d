// What drives the executive: a thread of its own in real time, the caller's turns under a virtual clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>

#include "core/clock.hpp"
#include "core/cpu_latency_request.hpp"
#include "core/cycle_times.hpp"
#include "core/locked_memory.hpp"
#include "core/stall_detector.hpp"
#include "rig/executive/cycle_grid.hpp"
#include "rig/executive/executive.hpp"
#include "rig/platform/real_time.hpp"

namespace tankrig {

/// For how long no step may be made in real time.
struct CyclePatience {
  Duration noticed = std::chrono::milliseconds{250};  ///< longer: it hangs
  Duration given_up = std::chrono::seconds{3};        ///< so much longer: it does not come back
};

/// Steps the executive at every point of its grid, from begin() to end().
/// In real time nothing the caller does holds a step up: a caller that hangs is noticed by its heartbeat. Overruns keep
/// the grid and are counted; too many of them within their window stop the executive. A step that hangs is noticed by
/// the caller's turns: from then on, and in every turn, the laser is switched off and the arm stopped past it. Under a
/// virtual clock step and caller take turns, which makes a run bit-reproducible, and no time is taken.
/// Threads: one, the supervisor's.
/// RT: its thread allocates nothing, takes no lock and waits for nothing but the next point (tests/real_time).
class Cycle {
 public:
  /// Asks the system for what `real_time` says, and goes on without what it is refused: see check_real_time().
  Cycle(Executive& executive, Clock& clock, Duration period, const RealTimeSettings& real_time = {},
        const CyclePatience& patience = {});
  /// The program dies, by its last resort, if the thread was left behind.
  ~Cycle() { end(); }
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  /// Does nothing the second time.
  void begin();
  /// Lets about one period pass; at least one step has been made when the first call returns, or it hangs.
  void turn() noexcept;
  /// No step is made after it returns true. False if its thread does not come back: then that is left behind, and with
  /// it this object and all that it uses, to the end of the program. If it does come back, it goes on making safe.
  bool end() noexcept;

  /// As the last turn saw it: inside a step, or without a processor, for longer than it may be.
  bool hangs() const noexcept { return silence_.stalled_for() > patience_.noticed; }
  /// Likewise: it will not come back.
  bool given_up() const noexcept { return silence_.stalled_for() > patience_.noticed + patience_.given_up; }
  /// A cycle of this program was left behind, and may still use its devices.
  /// Threads: any.
  static bool any_left_behind() noexcept;

  std::uint64_t cycles() const noexcept { return steps_.load(std::memory_order_acquire); }
  std::uint64_t overruns() const noexcept { return overruns_.load(std::memory_order_relaxed); }
  std::uint64_t missed_cycles() const noexcept { return missed_.load(std::memory_order_relaxed); }

  /// Nothing under a virtual clock.
  /// Threads: after end().
  const std::optional<CycleTimes>& times() const noexcept { return times_; }
  /// What the system gave.
  /// Threads: after the first turn().
  const RealTimeGrant& granted() const noexcept { return granted_; }

 private:
  void run() noexcept;
  void step() noexcept;
  void timed_step() noexcept;
  void publish() noexcept;
  void watch() noexcept;

  Executive& executive_;
  Clock& clock_;
  const Duration period_;
  const RealTimeSettings real_time_;
  const CyclePatience patience_;
  std::optional<LockedMemory> memory_;
  std::optional<CpuLatencyRequest> awake_;
  RealTimeGrant granted_;

  // The stepping thread's.
  CycleGrid grid_;
  OverrunWindow window_;
  PhaseLock phase_;
  std::optional<CycleTimes> times_;
  std::optional<Stamp> began_;  // the step before

  std::atomic<std::uint64_t> steps_{0}, overruns_{0}, missed_{0};
  std::atomic<bool> ending_{false}, ended_{false};

  // The caller's.
  StallDetector silence_;
  std::thread thread_;
};

}  // namespace tankrig
