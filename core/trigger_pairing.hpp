// Frames of two cameras that were exposed by the same trigger.
#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "core/clock.hpp"

namespace tankrig {

template <class Frame>
struct FramePair {
  Frame left, right;
};

/// Pure. A pair is two frames whose mid-exposures are within a tolerance, well below half a trigger period. Each stream
/// comes in the order of its stamps. `Frame` has a Stamp `stamp`, the middle of its exposure.
template <class Frame>
class TriggerPairing {
 public:
  explicit TriggerPairing(Duration tolerance) : tolerance_(tolerance) {}

  void add_left(Frame frame) { left_.push_back(std::move(frame)); }
  void add_right(Frame frame) { right_.push_back(std::move(frame)); }

  /// Nothing until another frame comes. Frames without a partner are dropped.
  std::optional<FramePair<Frame>> next() {
    while (!left_.empty() && !right_.empty()) {
      const Duration apart = left_.front().stamp - right_.front().stamp;
      if (apart > tolerance_) {
        right_.pop_front();
      } else if (-apart > tolerance_) {
        left_.pop_front();
      } else {
        FramePair<Frame> pair{std::move(left_.front()), std::move(right_.front())};
        left_.pop_front();
        right_.pop_front();
        return pair;
      }
    }
    return std::nullopt;
  }

 private:
  Duration tolerance_;
  std::deque<Frame> left_, right_;
};

}  // namespace tankrig
