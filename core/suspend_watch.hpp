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

  /// Was it, since the look before? The first look sees nothing, and a suspension is seen once. Never wrongly: only
  /// where the least that it has slept is more than the most that it had. A look that was interrupted itself may see a
  /// short one only at the next.
  bool look(const TimeAsleep& asleep) noexcept {
    const bool suspended = most_ && asleep.at_least > *most_ + kRounding;
    most_ = most_ && !suspended ? std::min(*most_, asleep.at_most) : asleep.at_most;
    return suspended;
  }

 private:
  std::optional<Duration> most_;
};

}  // namespace tankrig
