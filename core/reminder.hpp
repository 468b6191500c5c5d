// Says something again and again from a thread of its own, even if its owner is held up.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "core/time.hpp"

namespace tankrig {

/// While it lives, calls `say` after `first`, then every `again`, in its own thread.
class Reminder {
 public:
  Reminder(Duration first, Duration again, std::function<void()> say);
  /// Nothing is said after it returns.
  ~Reminder();
  Reminder(const Reminder&) = delete;
  Reminder& operator=(const Reminder&) = delete;

 private:
  std::mutex mutex_;  // guards ends_
  std::condition_variable wake_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace tankrig
