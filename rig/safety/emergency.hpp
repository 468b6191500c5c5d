// The last resort: a program that dies switches the laser off and stops the arm first.
#pragma once

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig {

/// While it lives, std::terminate (an exception that nobody caught, in any thread) and the signals of a crash (SIGSEGV,
/// SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP) call the last resort of the laser, then of the arm, again and
/// again for kLasts, in the thread that dies, whatever the others do; give the terminal its mode back; and only then
/// end the program as they would have. Bounded: a device that holds that thread up is left after a second by SIGALRM.
/// No handler runs where there is no stack left for it, nor after SIGKILL: docs/reference/safety.md.
/// One at a time. `laser` and `arm` outlive it.
class EmergencyStop {
 public:
  static constexpr Duration kLasts = std::chrono::milliseconds{200};

  EmergencyStop(Laser& laser, Arm& arm);
  ~EmergencyStop();
  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;
};

/// Does the same for a stop signal that must end the program now, and dies of it; of SIGTERM where `signal` only
/// suspends. Call it from that signal's handler, and return.
/// Threads: any. Async-signal-safe.
void end_safely(int signal) noexcept;

/// The program is dying: no light, no motion, whatever else is going on in it.
/// Threads: any.
/// RT: safe.
bool emergency_declared() noexcept;

}  // namespace tankrig
