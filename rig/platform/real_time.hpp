// What the cycle needs from the system, whether it is granted, and how to get it.
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

/// What this process would be refused of `settings`, with the cure; empty: nothing. Tries it on its own thread and
/// changes nothing.
std::string missing_real_time(const RealTimeSettings& settings);

/// run_scan's check before anything moves, in real time. Returns missing_real_time() if rights are not required.
/// Errors: InputError, one line.
std::string check_real_time(const RealTimeSettings& settings);

/// Makes the calling thread the cycle's: name, priority, processor, a touched stack. Does not lock memory or prevent
/// sleep.
RealTimeGrant become_real_time(const RealTimeSettings& settings) noexcept;

}  // namespace tankrig
