// A thread of this process that is held up wherever it is, as by a driver that hangs.
#pragma once

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <string>

#include "tests/support/named_thread.hpp"

namespace tankrig::testing_support {

/// A signal's handler waits in the thread of this name (PR_SET_NAME) until the end of its life. One at a time.
class HeldThread {
 public:
  explicit HeldThread(const std::string& name) {
    held_ = true;
    struct sigaction action {};
    action.sa_handler = wait;
    action.sa_flags = SA_RESTART;
    ::sigaction(SIGUSR2, &action, nullptr);
    for (int look = 0; look < 5000 && !found_; ++look) {  // it may only just begin
      found_ = signal_thread(::getpid(), name, SIGUSR2);
      const timespec pause{0, 1'000'000};
      ::nanosleep(&pause, nullptr);
    }
  }
  ~HeldThread() { held_ = false; }
  HeldThread(const HeldThread&) = delete;
  HeldThread& operator=(const HeldThread&) = delete;

  bool found() const { return found_; }

 private:
  static void wait(int) {
    const timespec pause{0, 1'000'000};
    while (held_) ::nanosleep(&pause, nullptr);
  }

  inline static std::atomic<bool> held_{false};
  bool found_ = false;
};

}  // namespace tankrig::testing_support
