#include "rig/sync/joint_history.hpp"

#include <algorithm>

namespace tankrig {

JointHistory::JointHistory(std::size_t capacity, Duration max_gap)
    : ring_(std::max<std::size_t>(capacity, 2)), max_gap_(max_gap) {}

void JointHistory::push(const JointState& state) noexcept {
  if (size_ > 0 && state.stamp <= at(size_ - 1).stamp) return;
  if (size_ < ring_.size()) {
    ring_[(first_ + size_++) % ring_.size()] = state;
  } else {
    ring_[first_] = state;
    first_ = (first_ + 1) % ring_.size();
  }
}

Result<SyncedJoints> JointHistory::interpolate(Stamp when) const noexcept {
  if (size_ == 0 || when > at(size_ - 1).stamp)
    return Error{ErrorCode::kNotReady, 0, when, "sync: no joint sample after the frame"};
  if (when < at(0).stamp) return Error{ErrorCode::kOutOfRange, 0, when, "sync: no joint sample before the frame"};

  std::size_t low = 0, high = size_ - 1;  // the first sample at or after `when` is in [low, high]
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (at(middle).stamp < when)
      low = middle + 1;
    else
      high = middle;
  }
  const bool alone = size_ == 1;
  const std::size_t upper = low == 0 && !alone ? 1 : low;
  const JointState& b = at(upper);
  const JointState& a = alone ? b : at(upper - 1);
  if (alone) return SyncedJoints{b.q, b.velocity, Duration{0}};
  if (b.stamp - a.stamp > max_gap_) return Error{ErrorCode::kRefused, 0, when, "sync: gap between joint samples"};

  const double span = seconds(b.stamp - a.stamp);
  const JointVector velocity = (b.q - a.q) / span;
  return SyncedJoints{a.q + velocity * seconds(when - a.stamp), velocity, std::min(when - a.stamp, b.stamp - when)};
}

}  // namespace tankrig
