// How late this machine lets a thread be that only wants to look at the clock and to pass a byte through a line.
#pragma once

#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "core/clock.hpp"

namespace tankrig::testing_support {

/// A machine as late has starved its emulators: one that is late so twice is taken for silent.
inline constexpr Duration kStarved = std::chrono::milliseconds{25};

/// The kernel carries a pseudo-terminal's bytes in a worker of its own: where that gets no time, lines and whoever
/// polls them stand still, whatever time threads get. Threads: any; owns one.
class MachineWitness {
 public:
  MachineWitness() : thread_([this] { run(); }) {}
  ~MachineWitness() {
    ends_ = true;
    thread_.join();
  }
  MachineWitness(const MachineWitness&) = delete;
  MachineWitness& operator=(const MachineWitness&) = delete;

  /// So far, at most.
  Duration latest() const noexcept { return Duration{latest_ns_}; }

 private:
  void run() {
    constexpr Duration kPeriod = std::chrono::milliseconds{2};
    constexpr int kLongest = 10'000;  // ms
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
      latest_ns_ = std::max<std::int64_t>(latest_ns_, (clock.now() - due).count());
    }
    if (line) ::close(here), ::close(there);
  }

  std::atomic<bool> ends_{false};
  std::atomic<std::int64_t> latest_ns_{0};
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace tankrig::testing_support
