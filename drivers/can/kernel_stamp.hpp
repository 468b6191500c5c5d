// Turns the kernel's receive stamps, which follow the wall clock, into the rig's time.
#pragma once

#include <ctime>
#include <optional>

#include "core/clock.hpp"

namespace tankrig {

/// Reads both clocks close together. Never later than now, never earlier than the previous stamp: a step of the wall
/// clock between a frame and its reading costs at most that frame's accuracy, not the order.
/// Threads: one.
/// RT: safe.
class StampConverter {
 public:
  /// If the clock does not keep real time, every stamp is its now().
  explicit StampConverter(const Clock& clock) : clock_(clock) {}
  Stamp operator()(const std::optional<timespec>& wall) noexcept;

 private:
  const Clock& clock_;
  Stamp last_{};
};

}  // namespace tankrig
