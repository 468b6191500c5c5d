// The last resort: a dying program first switches the laser off and stops the arm.
#pragma once

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig {

/// While it lives, std::terminate (an uncaught exception in any thread) and the signals of a crash (SIGSEGV, SIGBUS,
/// SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP) call the last resort of the laser, then of the arm, repeatedly for kLasts.
/// This runs in the dying thread, whatever the others do. Then the terminal gets its mode back, and the program ends as
/// it would have.
/// SIGALRM ends a device call that blocks for a second. No handler runs without stack left, nor after SIGKILL:
/// docs/reference/safety.md.
/// One at a time. `laser` and `arm` outlive it.
class EmergencyStop {
 public:
  static constexpr Duration kLasts = std::chrono::milliseconds{200};

  EmergencyStop(Laser& laser, Arm& arm);
  ~EmergencyStop();
  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;
};

/// Does the same for a stop signal that must end the program now, and dies of it; of SIGTERM if `signal` only suspends.
/// Call it from that signal's handler, then return.
/// Threads: any. Async-signal-safe.
void end_safely(int signal) noexcept;

/// The program is dying: no light and no motion from now on.
/// Threads: any.
/// RT: safe.
bool emergency_declared() noexcept;

}  // namespace tankrig
