// Whether the machine was suspended while somebody relied on its clock.
#pragma once

#include <algorithm>
#include <optional>

#include "core/clock.hpp"

namespace tankrig {

/// Threads: one.
/// RT: safe.
class SuspendWatch {
 public:
  /// Both clocks are rounded to nanoseconds; a machine sleeps longer than this.
  static constexpr Duration kRounding = std::chrono::milliseconds{1};

  /// Whether the machine was suspended since the last look. The first look sees nothing, and a suspension is seen once.
  /// Never a false alarm: the least time it can have slept must exceed the most it had. An interrupted look may see a
  /// short suspension only at the next one.
  bool look(const TimeAsleep& asleep) noexcept {
    const bool suspended = most_ && asleep.at_least > *most_ + kRounding;
    most_ = most_ && !suspended ? std::min(*most_, asleep.at_most) : asleep.at_most;
    return suspended;
  }

 private:
  std::optional<Duration> most_;
};

}  // namespace tankrig
