// How late this machine lets a thread be that only wants to look at the clock and to pass a byte through a line; and
// the end of a test of the wall's clock where that was too late.
#pragma once

#include <poll.h>
#include <pthread.h>
#include <pty.h>
#include <sched.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.hpp"

/// Ends a test whose machine did not keep time: before what is asserted of the wall's clock, after what is not. `bound`
/// is the test's own: what its assertions bear. In the test's body, as GTEST_SKIP. A failure before it stays one.
#define TANKRIG_SKIP_IF_LATE(witness, bound)                                                           \
  if (const ::tankrig::Duration late_by = (witness).latest(); late_by <= ::tankrig::Duration{bound}) { \
  } else                                                                                               \
    GTEST_SKIP() << ::tankrig::testing_support::machine_was_late(late_by, bound)

namespace tankrig::testing_support {

/// A machine as late has starved its emulators: one that is late so twice is taken for silent.
inline constexpr Duration kStarved = std::chrono::milliseconds{25};

/// Words that the end of `./run test` counts.
inline std::string machine_was_late(Duration by, Duration bound) {
  char text[96];
  std::snprintf(text, sizeof text, "skipped because the machine was late: by %.1f ms, at most %.1f ms allowed",
                1e3 * seconds(by), 1e3 * seconds(bound));
  return text;
}

/// An ordinary thread on each processor that asks to be woken every 2 ms. The kernel carries a pseudo-terminal's bytes
/// in a worker of its own: where that gets no time, lines and whoever polls them stand still, whatever time threads
/// get.
///
/// It tells that a processor was not to be had, to within its period: by a host that lent it to others, by other
/// programs, by an interrupt. It does not tell by whom. An ordinary thread of the code under test that never lets go
/// delays it by no more than the scheduler's turn, a few milliseconds: state no bound below that. A real-time thread
/// that never lets go delays it as a thief does, and its test would be skipped: so the skips are counted at the run's
/// end, and on a machine that keeps time each of them is a fault to be found.
/// Threads: any; owns one on each processor.
class MachineWitness {
 public:
  MachineWitness() {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) CPU_SET(0, &allowed);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &allowed)) continue;
      std::atomic<std::int64_t>& due_ns = due_ns_.emplace_back(clock_.now().ns);
      threads_.emplace_back([this, cpu, &due_ns] { watch(cpu, due_ns); });
    }
  }
  ~MachineWitness() { end(); }
  MachineWitness(const MachineWitness&) = delete;
  MachineWitness& operator=(const MachineWitness&) = delete;

  /// So far, at most; also where a processor or a line has not come back yet.
  Duration latest() const noexcept {
    std::int64_t latest_ns = 0;
    const std::int64_t now_ns = clock_.now().ns;
    if (!ends_)
      for (const std::atomic<std::int64_t>& due_ns : due_ns_) latest_ns = std::max(latest_ns, now_ns - due_ns);
    return Duration{std::max<std::int64_t>(latest_ns, latest_ns_)};  // after the others: a watcher notes, then goes on
  }

  static constexpr Duration kPunctual = std::chrono::milliseconds{1};
  struct Late {
    Stamp due, came;
  };
  /// Ends the watch: when a processor, or a line, was late by more than kPunctual.
  std::vector<Late> lateness() {
    end();
    return late_;
  }
  /// Ends the watch: at most, of what overlaps this time.
  Duration latest(Stamp from, Stamp to) {
    Duration latest{};
    for (const Late& late : lateness())
      if (late.came >= from && late.due <= to) latest = std::max(latest, late.came - late.due);
    return latest;
  }

 private:
  void end() {
    ends_ = true;
    for (std::thread& thread : threads_)
      if (thread.joinable()) thread.join();
  }

  void watch(int cpu, std::atomic<std::int64_t>& due_ns) {
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
    Stamp due{due_ns};
    do {  // also where it only came to run at the watch's end
      clock.sleep_until(due);
      char byte = 0;
      pollfd door{here, POLLIN, 0};
      if (line && ::write(there, &byte, 1) == 1 && ::poll(&door, 1, kLongest) == 1) (void)!::read(here, &byte, 1);
      const Stamp came = clock.now();
      note({due, came});
      due = came + kPeriod;  // no time between that nobody watches
      due_ns = due.ns;
    } while (!ends_);
    if (line) ::close(here), ::close(there);
  }

  void note(const Late& late) {
    if (late.came - late.due <= kPunctual) return;
    const std::lock_guard lock(mutex_);
    latest_ns_ = std::max<std::int64_t>(latest_ns_, (late.came - late.due).count());
    late_.push_back(late);
  }

  const MonotonicClock clock_;
  std::mutex mutex_;
  std::vector<Late> late_;
  std::deque<std::atomic<std::int64_t>> due_ns_;  // of each processor's next wake-up
  std::atomic<bool> ends_{false};
  std::atomic<std::int64_t> latest_ns_{0};
  std::vector<std::thread> threads_;
};

}  // namespace tankrig::testing_support
