// What drives the executive: a thread of its own in real time, the caller's turns under a virtual clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>

#include "core/clock.hpp"
#include "core/locked_memory.hpp"
#include "rig/executive/cycle_grid.hpp"
#include "rig/executive/cycle_times.hpp"
#include "rig/executive/executive.hpp"
#include "rig/platform/real_time.hpp"

namespace tankrig {

/// Steps the executive at every point of its grid, from begin() to end().
/// In real time nothing the caller does holds a step up: a caller that hangs is noticed by its heartbeat. Overruns keep
/// the grid and are counted; too many of them within their window stop the executive. Under a virtual clock step and
/// caller take turns, which makes a run bit-reproducible, and no time is taken.
/// Threads: one, the supervisor's.
/// RT: its thread allocates nothing, takes no lock and waits for nothing but the next point (tests/executive).
class Cycle {
 public:
  /// Asks the system for what `real_time` says, and goes on without what it is refused: see check_real_time().
  Cycle(Executive& executive, Clock& clock, Duration period, const RealTimeSettings& real_time = {});
  ~Cycle() { end(); }
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  /// Does nothing the second time.
  void begin();
  /// Lets about one period pass; at least one step has been made when the first call returns.
  void turn() noexcept;
  /// No step is made after it returns.
  void end() noexcept;

  std::uint64_t cycles() const noexcept { return steps_.load(std::memory_order_acquire); }
  std::uint64_t overruns() const noexcept { return overruns_.load(std::memory_order_relaxed); }
  std::uint64_t missed_cycles() const noexcept { return missed_.load(std::memory_order_relaxed); }

  /// Nothing under a virtual clock.  Threads: after end().
  const std::optional<CycleTimes>& times() const noexcept { return times_; }
  /// What the system gave.  Threads: after the first turn().
  const RealTimeGrant& granted() const noexcept { return granted_; }

 private:
  void run() noexcept;
  void step() noexcept;
  void timed_step() noexcept;
  void publish() noexcept;

  Executive& executive_;
  Clock& clock_;
  const Duration period_;
  const RealTimeSettings real_time_;
  std::optional<LockedMemory> memory_;
  RealTimeGrant granted_;

  // The stepping thread's.
  CycleGrid grid_;
  OverrunWindow window_;
  PhaseLock phase_;
  std::optional<CycleTimes> times_;
  std::optional<Stamp> began_;  // the step before

  std::atomic<std::uint64_t> steps_{0}, overruns_{0}, missed_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace tankrig
