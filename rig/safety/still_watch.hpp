// Whether the arm's encoders stand: rest without angles, for an arm that is not homed.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "core/joint_state.hpp"

namespace tankrig {

/// At rest: no encoder has left a band of three neighbouring ticks for kWindow. An encoder at rest may flicker over
/// them; one that creeps does not stay within them.
/// Threads: one.
/// RT: safe.
class StillWatch {
 public:
  static constexpr Duration kWindow = std::chrono::milliseconds{200};
  static constexpr std::int32_t kFlicker = 2;
  /// After a longer silence an arm no longer counts as at rest.
  static constexpr Duration kNewsAge = std::chrono::milliseconds{250};

  /// Samples in order of their stamps.
  void add(const JointState& joints) noexcept {
    bool left = !since_;
    for (std::size_t j = 0; j < kJoints && !left; ++j) {
      const std::int32_t low = std::min(low_[j], joints.ticks[j]), high = std::max(high_[j], joints.ticks[j]);
      left = high - low > kFlicker;
      low_[j] = low;
      high_[j] = high;
    }
    if (left) {
      low_ = high_ = joints.ticks;
      since_ = joints.stamp;
    }
    at_rest_ = joints.stamp - *since_ >= kWindow;
  }

  bool at_rest() const noexcept { return at_rest_; }

 private:
  std::array<std::int32_t, kJoints> low_{}, high_{};  // since
  std::optional<Stamp> since_;
  bool at_rest_ = false;
};

}  // namespace tankrig
