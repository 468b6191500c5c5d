// Ctrl-C, Ctrl-Z, a polite kill and a closed terminal as a request to stop.
#pragma once

#include <atomic>

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

}  // namespace tankrig::app
