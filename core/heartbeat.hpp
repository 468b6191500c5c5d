// Whether a thread that the rig depends on still goes round: told by the thread, asked by others.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

#include "core/time.hpp"

namespace tankrig {

/// A thread that has ended, or has not come round for longer than `longest`, is dead to those who depend on it.
/// Threads: the thread gives and rests, whoever gives it work expects, any asks.
/// RT: safe.
class Heartbeat {
 public:
  /// A thread that waits for its device comes round several times within this.
  static constexpr Duration kUsual = std::chrono::seconds(1);

  explicit Heartbeat(Duration longest = kUsual) noexcept : longest_(longest) {}

  void give(Stamp now) noexcept { given_ns_.store(now.ns, std::memory_order_relaxed); }
  /// It waits for work: no sign is due until one is expected.
  void rest() noexcept { given_ns_.store(kResting, std::memory_order_relaxed); }
  /// Work has come, if it rests.
  void expect(Stamp now) noexcept {
    std::int64_t resting = kResting;
    given_ns_.compare_exchange_strong(resting, now.ns, std::memory_order_relaxed);
  }
  /// It has ended though nobody asked it to; for good.
  void end() noexcept { ended_.store(true, std::memory_order_relaxed); }

  bool missing(Stamp now) const noexcept {
    return ended_.load(std::memory_order_relaxed) ||
           now.ns - longest_.count() > given_ns_.load(std::memory_order_relaxed);
  }

 private:
  static constexpr std::int64_t kResting = std::numeric_limits<std::int64_t>::max();

  const Duration longest_;
  std::atomic<std::int64_t> given_ns_{kResting};
  std::atomic<bool> ended_{false};
};

}  // namespace tankrig
