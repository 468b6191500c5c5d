// A machine whose processors are never idle.
#pragma once

#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <thread>
#include <vector>

namespace tankrig::testing_support {

/// A virtual machine gets an idle processor back late, by tens of milliseconds where its host is busy. While this
/// lives, each is kept busy by a thread of SCHED_IDLE: whoever wants it has it at once.
class AwakeMachine {
 public:
  AwakeMachine() {
    for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i)
      threads_.emplace_back([this] {
        const sched_param none{};
        if (::pthread_setschedparam(::pthread_self(), SCHED_IDLE, &none) != 0) return;
        while (!ends_.load(std::memory_order_relaxed)) {
        }
      });
  }
  ~AwakeMachine() {
    ends_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  AwakeMachine(const AwakeMachine&) = delete;
  AwakeMachine& operator=(const AwakeMachine&) = delete;

 private:
  std::atomic<bool> ends_{false};
  std::vector<std::thread> threads_;
};

}  // namespace tankrig::testing_support
