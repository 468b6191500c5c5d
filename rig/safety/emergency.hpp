// The last resort: a program that dies switches the laser off and stops the arm first.
#pragma once

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig {

/// While it lives, std::terminate (an exception that nobody caught, in any thread) and the signals of a crash (SIGSEGV,
/// SIGBUS, SIGFPE, SIGILL, SIGABRT) command the laser off, then the arm to stop, again and again for kLasts so that the
/// devices' own threads can send it, give the terminal its mode back, and only then end the program as they would have.
/// Bounded: a device that holds the calling thread up is left after a second by SIGALRM.
/// One at a time. `laser` and `arm` outlive it.
class EmergencyStop {
 public:
  static constexpr Duration kLasts = std::chrono::milliseconds{200};

  EmergencyStop(Laser& laser, Arm& arm);
  ~EmergencyStop();
  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;
};

/// The program is dying: no light, no motion, whatever else is going on in it.  Threads: any.  RT: safe.
bool emergency_declared() noexcept;

}  // namespace tankrig
