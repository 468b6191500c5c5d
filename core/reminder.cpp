#include "core/reminder.hpp"

#include <utility>

namespace tankrig {

Reminder::Reminder(Duration first, Duration again, std::function<void()> say)
    : thread_([this, first, again, say = std::move(say)] {
        std::unique_lock lock(mutex_);
        for (Duration wait = first; !wake_.wait_for(lock, wait, [this] { return ends_; }); wait = again) {
          lock.unlock();
          say();
          lock.lock();
        }
      }) {}

Reminder::~Reminder() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

}  // namespace tankrig
