// The clock is a parameter: real (absolute sleep) or virtual (as fast as possible, deterministic).
#pragma once

#include <atomic>

#include "core/time.hpp"

namespace tankrig {

/// How long the machine has been suspended so far: two bounds that hold even if the reading is interrupted.
struct TimeAsleep {
  Duration at_least{}, at_most{};
};

class Clock {
 public:
  virtual ~Clock() = default;
  virtual Stamp now() const noexcept = 0;
  /// Returns at or after `when`; at once if `when` has passed.
  virtual void sleep_until(Stamp when) noexcept = 0;
  /// Whether time passes while nobody sleeps.
  virtual bool real_time() const noexcept = 0;
  /// now() does not count it, so every time-out looks fresh afterwards: see SuspendWatch.
  /// RT: safe.
  virtual TimeAsleep asleep() const noexcept { return {}; }
};

/// CLOCK_MONOTONIC with clock_nanosleep(TIMER_ABSTIME); asleep by what CLOCK_BOOTTIME is ahead of it.
/// RT: safe.
class MonotonicClock final : public Clock {
 public:
  Stamp now() const noexcept override;
  void sleep_until(Stamp when) noexcept override;
  bool real_time() const noexcept override { return true; }
  TimeAsleep asleep() const noexcept override;

  /// The default clock.
  static const MonotonicClock& one() noexcept;
};

/// Time that moves only when somebody sleeps.
/// Threads: one sleeps, any may ask.
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(Stamp start = {}) : now_ns_(start.ns) {}
  Stamp now() const noexcept override { return {now_ns_.load(std::memory_order_relaxed)}; }
  void sleep_until(Stamp when) noexcept override {
    if (when > now()) now_ns_.store(when.ns, std::memory_order_relaxed);
  }
  bool real_time() const noexcept override { return false; }
  TimeAsleep asleep() const noexcept override {
    const Duration asleep{asleep_ns_.load(std::memory_order_relaxed)};
    return {asleep, asleep};
  }
  /// Suspends the machine for this long; it wakes at now().
  void suspend(Duration duration) noexcept { asleep_ns_.fetch_add(duration.count(), std::memory_order_relaxed); }

 private:
  std::atomic<std::int64_t> now_ns_, asleep_ns_{0};
};

}  // namespace tankrig
