// How late this machine lets a thread be that only wants to look at the clock and to pass a byte through a line.
#pragma once

#include <poll.h>
#include <pthread.h>
#include <pty.h>
#include <sched.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include "core/clock.hpp"

namespace tankrig::testing_support {

/// A machine as late has starved its emulators: one that is late so twice is taken for silent.
inline constexpr Duration kStarved = std::chrono::milliseconds{25};

/// The kernel carries a pseudo-terminal's bytes in a worker of its own: where that gets no time, lines and whoever
/// polls them stand still, whatever time threads get. Threads: any; owns one on each processor.
class MachineWitness {
 public:
  MachineWitness() {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) CPU_SET(0, &allowed);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
      if (CPU_ISSET(cpu, &allowed)) threads_.emplace_back([this, cpu] { watch(cpu); });
  }
  ~MachineWitness() { end(); }
  MachineWitness(const MachineWitness&) = delete;
  MachineWitness& operator=(const MachineWitness&) = delete;

  /// So far, at most.
  Duration latest() const noexcept { return Duration{latest_ns_}; }

  struct Late {
    Stamp due, came;
  };
  /// Ends the watch: when a processor, or a line, was late by more than kPunctual.
  std::vector<Late> lateness() {
    end();
    return late_;
  }

 private:
  static constexpr Duration kPunctual = std::chrono::milliseconds{1};

  void end() {
    ends_ = true;
    for (std::thread& thread : threads_)
      if (thread.joinable()) thread.join();
  }

  void watch(int cpu) {
    constexpr Duration kPeriod = std::chrono::milliseconds{2};
    constexpr int kLongest = 10'000;  // ms
    cpu_set_t only;
    CPU_ZERO(&only);
    CPU_SET(cpu, &only);
    (void)::pthread_setaffinity_np(::pthread_self(), sizeof only, &only);
    MonotonicClock clock;
    termios raw{};
    ::cfmakeraw(&raw);
    int here = -1, there = -1;
    const bool line = ::openpty(&here, &there, nullptr, &raw, nullptr) == 0;
    while (!ends_) {
      const Stamp due = clock.now() + kPeriod;
      clock.sleep_until(due);
      char byte = 0;
      pollfd door{here, POLLIN, 0};
      if (line && ::write(there, &byte, 1) == 1 && ::poll(&door, 1, kLongest) == 1) (void)!::read(here, &byte, 1);
      note({due, clock.now()});
    }
    if (line) ::close(here), ::close(there);
  }

  void note(const Late& late) {
    if (late.came - late.due <= kPunctual) return;
    const std::lock_guard lock(mutex_);
    latest_ns_ = std::max<std::int64_t>(latest_ns_, (late.came - late.due).count());
    late_.push_back(late);
  }

  std::mutex mutex_;
  std::vector<Late> late_;
  std::atomic<bool> ends_{false};
  std::atomic<std::int64_t> latest_ns_{0};
  std::vector<std::thread> threads_;
};

}  // namespace tankrig::testing_support
