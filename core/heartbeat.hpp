// Whether a thread that the rig depends on still runs: the thread reports, others ask.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

#include "core/time.hpp"

namespace tankrig {

/// A thread that has ended, or has not reported for longer than `longest`, counts as dead.
/// Threads: the thread gives and rests; whoever hands it work calls expect; any asks.
/// RT: safe.
class Heartbeat {
 public:
  /// A thread that waits for its device reports several times within this.
  static constexpr Duration kUsual = std::chrono::seconds(1);

  explicit Heartbeat(Duration longest = kUsual) noexcept : longest_(longest) {}

  void give(Stamp now) noexcept { given_ns_.store(now.ns, std::memory_order_relaxed); }
  /// It waits for work: no report is due until expect().
  void rest() noexcept { given_ns_.store(kResting, std::memory_order_relaxed); }
  /// Work has come: a resting thread must report again.
  void expect(Stamp now) noexcept {
    std::int64_t resting = kResting;
    given_ns_.compare_exchange_strong(resting, now.ns, std::memory_order_relaxed);
  }
  /// It ended without being asked to; for good.
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
