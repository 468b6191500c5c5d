// How punctual the cycle was.
#pragma once

#include <cstdint>

#include "core/histogram.hpp"

namespace tankrig {

/// Of a cycle in real time, from its first step on.
struct CycleTimes {
  Histogram wake_up;    ///< from the grid point to the thread running
  Histogram execution;  ///< of one step
  Histogram period;     ///< from one step's beginning to the next one's
  std::uint64_t cycles = 0, overruns = 0, missed_cycles = 0;
};

}  // namespace tankrig
