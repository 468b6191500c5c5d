// Ctrl-C, a polite kill and a closed terminal as a request to stop.
#pragma once

#include <atomic>

namespace tankrig::app {

/// While it lives, the first such signal sets requested(); a second one ends the program at once.  One at a time.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  static const std::atomic<bool>& requested();
};

}  // namespace tankrig::app
