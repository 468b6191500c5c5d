// A real clock on a machine that a test suspends.
#pragma once

#include <atomic>

#include "core/clock.hpp"

namespace tankrig::testing_support {

/// Goes like the machine's own; it has slept for as long as it is told.
/// Threads: any.
class SleepyClock final : public Clock {
 public:
  Stamp now() const noexcept override { return real_.now(); }
  void sleep_until(Stamp when) noexcept override { real_.sleep_until(when); }
  bool real_time() const noexcept override { return true; }
  TimeAsleep asleep() const noexcept override {
    const Duration asleep{asleep_ns_};
    return {asleep, asleep};
  }
  void suspend(Duration duration) noexcept { asleep_ns_ += duration.count(); }

 private:
  MonotonicClock real_;
  std::atomic<std::int64_t> asleep_ns_{0};
};

}  // namespace tankrig::testing_support
