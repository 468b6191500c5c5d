// Says something again and again, whatever the one who wants it said is held up by.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "core/time.hpp"

namespace tankrig {

/// While it lives: `say` after `first`, then every `again`, in a thread of its own.
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
