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
#include "core/wake_up_counts.hpp"
#include "rig/executive/cycle_grid.hpp"
#include "rig/executive/executive.hpp"
#include "rig/platform/real_time.hpp"

namespace tankrig {

/// How long the cycle may make no step in real time.
struct CyclePatience {
  Duration noticed = std::chrono::milliseconds{250};  ///< longer: it hangs
  Duration given_up = std::chrono::seconds{3};        ///< so much longer: it is left behind
};

/// Steps the executive at every point of its grid, from begin() to end().
/// In real time the caller cannot hold up a step; its heartbeat shows if the caller hangs. Overruns keep the grid and
/// are counted; too many within their window stop the executive. The caller's turns notice a step that hangs: from then
/// on, every turn switches the laser off and stops the arm past it.
/// Under a virtual clock step and caller take turns and no time passes, so a run is bit-reproducible.
/// Threads: one, the supervisor's.
/// RT: its thread allocates nothing, takes no lock and waits for nothing but the next point (tests/real_time).
class Cycle {
 public:
  /// Asks the system for what `real_time` says, and goes on without what is refused: see check_real_time().
  Cycle(Executive& executive, Clock& clock, Duration period, const RealTimeSettings& real_time = {},
        const CyclePatience& patience = {});
  /// If the thread was left behind, the program dies by its last resort.
  ~Cycle() { end(); }
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  /// A second call does nothing.
  void begin();
  /// Lets about one period pass. When the first call returns, at least one step has been made, or it hangs.
  void turn() noexcept;
  /// True: no step follows. False: the thread does not come back. Then it is left behind with this object and
  /// everything it uses, until the program ends. If it does come back, it keeps making safe.
  bool end() noexcept;

  /// At the last turn, it was too long inside a step or without a processor.
  bool hangs() const noexcept { return silence_.stalled_for() > patience_.noticed; }
  /// At the last turn, it was considered lost.
  bool given_up() const noexcept { return silence_.stalled_for() > patience_.noticed + patience_.given_up; }
  /// A cycle of this program was left behind and may still use its devices.
  /// Threads: any.
  static bool any_left_behind() noexcept;

  std::uint64_t cycles() const noexcept { return steps_.load(std::memory_order_acquire); }
  std::uint64_t overruns() const noexcept { return overruns_.load(std::memory_order_relaxed); }
  std::uint64_t missed_cycles() const noexcept { return missed_.load(std::memory_order_relaxed); }

  /// So far; nothing under a virtual clock.
  std::optional<WakeUpCounts::Seen> wake_ups() const noexcept {
    return clock_.real_time() ? std::optional(wake_ups_.seen()) : std::nullopt;
  }

  /// Empty under a virtual clock.
  /// Threads: after end().
  const std::optional<CycleTimes>& times() const noexcept { return times_; }
  /// What the system granted.
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
  WakeUpCounts wake_ups_;

  // The caller's.
  StallDetector silence_;
  std::thread thread_;
};

}  // namespace tankrig
