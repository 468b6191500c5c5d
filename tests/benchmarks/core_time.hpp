// What work costs one core, whatever else the machine does.
#pragma once

#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <limits>

namespace tankrig {

/// Time this thread has had a core to itself.
inline double core_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The least of several rounds: what others do only adds.
struct LeastCost {
  double seconds = std::numeric_limits<double>::infinity();

  template <class Work>
  void take(Work work) {
    const double begin = core_seconds();
    benchmark::DoNotOptimize(work());
    seconds = std::min(seconds, core_seconds() - begin);
  }
};

}  // namespace tankrig
