// What one request to the arm carries and asks for: everything, or the swept joint and the others in turn.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig {

using JointSet = std::uint8_t;  ///< a bit per joint, in the order of `Joint`

inline constexpr JointSet kEveryJoint = (1U << kJoints) - 1;
constexpr JointSet only(std::size_t joint) noexcept { return static_cast<JointSet>(1U << joint); }
constexpr bool holds(JointSet set, std::size_t joint) noexcept { return (set & only(joint)) != 0; }

/// The default is the whole exchange: every demand, the master's bytes, every sensor slot.
struct ArmExchange {
  JointSet demands = kEveryJoint;
  JointSet sensors = kEveryJoint;
  bool master = true;

  constexpr bool whole() const noexcept { return demands == kEveryJoint; }
  bool operator==(const ArmExchange&) const = default;
};

/// The order of requests. Without a fast joint every request is whole. With one, each request carries that joint's
/// demand, asks for its sensor slot, and adds one more thing in turn: another joint's demand, another joint's sensor
/// slot, or the master's bytes. So request and answer have at most three slots, and everything comes round within
/// kFastRound requests. No two successive requests are alike.
/// RT: safe.
class ExchangeSchedule {
 public:
  static constexpr int kFastRound = 2 * (kJoints - 1) + 1;

  explicit ExchangeSchedule(std::optional<Joint> fast = {}) : fast_(fast) {}

  ArmExchange next() const noexcept {
    if (!fast_ || whole_next_) return {};
    const auto fast = static_cast<std::size_t>(*fast_);
    ArmExchange exchange{only(fast), only(fast), false};
    const auto other = (fast + 1 + static_cast<std::size_t>(turn_) / 2) % kJoints;
    if (turn_ == kFastRound - 1)
      exchange.master = true;
    else if (turn_ % 2 == 0)
      exchange.demands |= only(other);
    else
      exchange.sensors |= only(other);
    return exchange;
  }

  /// next() is on its way; moves on to the following one.
  void advance() noexcept {
    if (std::exchange(whole_next_, false)) return;
    turn_ = (turn_ + 1) % kFastRound;
  }

  /// Makes the next request a whole one.
  void begin_whole() noexcept { whole_next_ = true; }

 private:
  std::optional<Joint> fast_;
  int turn_ = 0;
  bool whole_next_ = false;
};

/// When the arm last reported each joint and itself.
/// RT: safe.
class LastHeard {
 public:
  explicit LastHeard(Stamp begin = {}) { everything(begin); }

  void everything(Stamp now) noexcept {
    joints_.fill(now);
    master_ = now;
  }
  void of(const ArmExchange& heard, Stamp now) noexcept {
    for (std::size_t j = 0; j < kJoints; ++j)
      if (holds(heard.sensors, j)) joints_[j] = now;
    if (heard.master) master_ = now;
  }
  Stamp oldest() const noexcept { return std::min(master_, *std::min_element(joints_.begin(), joints_.end())); }

 private:
  std::array<Stamp, kJoints> joints_{};
  Stamp master_{};
};

}  // namespace tankrig
