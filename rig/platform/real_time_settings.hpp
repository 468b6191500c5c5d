// How the cycle asks for the processor: `real_time` in the rig file's `scan` section as plain numbers.
#pragma once

#include <optional>

#include "core/enum_names.hpp"

namespace tankrig {

enum class CyclePace : unsigned char {
  kClock,   ///< every 1 / cycle_hz
  kDevice,  ///< the same, steered by at most half a percent to keep step with an arm that samples by its own clock
};
template <>
inline constexpr std::array kNames<CyclePace>{"clock", "device"};

/// docs/reference/real_time.md says what the system must grant, and which files grant it.
struct RealTimeSettings {
  bool required = true;     ///< false: missing rights are reported, and the scan goes on
  int priority = 80;        ///< of SCHED_FIFO, 1 .. 98
  std::optional<int> cpu;   ///< the only processor the cycle runs on
  bool lock_memory = true;  ///< the process's memory stays where it is
  int overruns = 10;        ///< so many late cycles within the window stop the scan; 0: they are only counted
  double window = 1;        ///< [s]
  CyclePace pace = CyclePace::kClock;
};

}  // namespace tankrig
