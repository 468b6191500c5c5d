// Ctrl-C, Ctrl-Z, a polite kill, a closed terminal and the stop key as a request to stop.
#pragma once

#include <atomic>

#include "apps/tankrig/backend.hpp"
#include "apps/tankrig/progress.hpp"
#include "rig/safety/emergency.hpp"
#include "rig/safety/stop_key.hpp"

namespace tankrig::app {

/// While it lives, such a signal sets requested(); the third one ends the program whatever it is doing.  One at a time.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  static const std::atomic<bool>& requested();
};

/// While laser or arm may do something: the stop key of the terminal, which is told on the screen, and the last resort
/// of a program that dies.  One at a time.
class RigStops {
 public:
  RigStops(Backend& backend, Progress& progress);

 private:
  EmergencyStop emergency_;
  StopKey key_;
};

}  // namespace tankrig::app
