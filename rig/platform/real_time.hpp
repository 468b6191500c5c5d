// What the cycle needs of the system, whether it is granted, and how to get it.
#pragma once

#include <string>
#include <vector>

#include "rig/platform/real_time_settings.hpp"

namespace tankrig {

/// What the system gave the cycle.
struct RealTimeGrant {
  bool fifo = false;              ///< SCHED_FIFO at the priority asked for
  bool cpu = false;               ///< its processor; true if none was asked for
  bool memory_locked = false;     ///< true only if it was asked for
  bool processors_awake = false;  ///< no deep sleep while it runs; a scan goes on without it
};

/// What of `settings` this process would be refused, in words that say how to get it; empty if nothing. Tries it on a
/// thread of its own, and changes nothing.
std::string missing_real_time(const RealTimeSettings& settings);

/// What run_scan refuses before anything moves, where the clock is real. Returns missing_real_time() where it is not
/// required.
/// Errors: InputError, one line.
std::string check_real_time(const RealTimeSettings& settings);

/// Makes the calling thread the cycle's: name, priority, processor, a stack already touched. Memory and sleep are not
/// its concern.
RealTimeGrant become_real_time(const RealTimeSettings& settings) noexcept;

}  // namespace tankrig
