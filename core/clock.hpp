// The clock is a parameter: real (absolute sleep) or virtual (as fast as possible, deterministic).
#pragma once

#include <atomic>

#include "core/time.hpp"

namespace tankrig {

class Clock {
 public:
  virtual ~Clock() = default;
  virtual Stamp now() const noexcept = 0;
  /// Returns at or after `when`; at once if `when` has passed.
  virtual void sleep_until(Stamp when) noexcept = 0;
  /// Time passes whether anybody sleeps or not.
  virtual bool real_time() const noexcept = 0;
};

/// CLOCK_MONOTONIC with clock_nanosleep(TIMER_ABSTIME).  RT: safe.
class MonotonicClock final : public Clock {
 public:
  Stamp now() const noexcept override;
  void sleep_until(Stamp when) noexcept override;
  bool real_time() const noexcept override { return true; }
};

/// Time that moves only when somebody sleeps.  Threads: one sleeps, any may ask for now().
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(Stamp start = {}) : now_ns_(start.ns) {}
  Stamp now() const noexcept override { return {now_ns_.load(std::memory_order_relaxed)}; }
  void sleep_until(Stamp when) noexcept override {
    if (when > now()) now_ns_.store(when.ns, std::memory_order_relaxed);
  }
  bool real_time() const noexcept override { return false; }

 private:
  std::atomic<std::int64_t> now_ns_;
};

}  // namespace tankrig
