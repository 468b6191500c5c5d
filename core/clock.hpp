// The clock is a parameter: real (absolute sleep) or virtual (as fast as possible, deterministic).
#pragma once

#include "core/time.hpp"

namespace tankrig {

class Clock {
 public:
  virtual ~Clock() = default;
  virtual Stamp now() const noexcept = 0;
  /// Returns at or after `when`; at once if `when` has passed.
  virtual void sleep_until(Stamp when) noexcept = 0;
};

/// CLOCK_MONOTONIC with clock_nanosleep(TIMER_ABSTIME).  RT: safe.
class MonotonicClock final : public Clock {
 public:
  Stamp now() const noexcept override;
  void sleep_until(Stamp when) noexcept override;
};

/// Time that moves only when somebody sleeps.  Threads: one.
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(Stamp start = {}) : now_(start) {}
  Stamp now() const noexcept override { return now_; }
  void sleep_until(Stamp when) noexcept override {
    if (when > now_) now_ = when;
  }

 private:
  Stamp now_;
};

}  // namespace tankrig
