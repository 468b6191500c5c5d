// A sweep's curves while it runs, for whoever listens to the feed.
#pragma once

#include <chrono>

#include "bench/benchmark/point_store.hpp"

namespace tankrig::app {

/// Threads: one at a time.
class LivePlots {
 public:
  /// `benchmark` outlives this.
  explicit LivePlots(const Benchmark& benchmark) : benchmark_(benchmark) {}

  /// Draws all that `rows` hold, if somebody listens: every two seconds at most, and so seldom that it takes a twentieth of
  /// the time; `last`: at once.
  void tell(const PointRows& rows, bool last = false);

 private:
  const Benchmark& benchmark_;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace tankrig::app
