// What drives the executive: a thread of its own in real time, the caller's turns under a virtual clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "core/clock.hpp"
#include "rig/executive/cycle_grid.hpp"
#include "rig/executive/executive.hpp"

namespace tankrig {

/// Steps the executive at every point of its grid, from begin() to end().
/// In real time nothing the caller does holds a step up: a caller that hangs is noticed by its heartbeat. Under a
/// virtual clock step and caller take turns, which makes a run bit-reproducible.
/// Threads: one, the supervisor's.
class Cycle {
 public:
  Cycle(Executive& executive, Clock& clock, Duration period);
  ~Cycle() { end(); }
  Cycle(const Cycle&) = delete;
  Cycle& operator=(const Cycle&) = delete;

  /// Does nothing the second time.
  void begin();
  /// Lets about one period pass; at least one step has been made when the first call returns.
  void turn() noexcept;
  /// No step is made after it returns.
  void end() noexcept;

  std::uint64_t overruns() const noexcept { return overruns_.load(std::memory_order_relaxed); }
  std::uint64_t missed_cycles() const noexcept { return missed_.load(std::memory_order_relaxed); }

 private:
  void step() noexcept;

  Executive& executive_;
  Clock& clock_;
  const Duration period_;
  CycleGrid grid_;  // the stepping thread's
  std::atomic<std::uint64_t> steps_{0}, overruns_{0}, missed_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace tankrig
