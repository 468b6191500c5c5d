// The joints at the instant of a frame's exposure: interpolated between two samples, or refused.
#pragma once

#include <vector>

#include "core/result.hpp"
#include "drivers/arm/arm.hpp"

namespace tankrig {

/// Joints at a requested stamp.
struct SyncedJoints {
  JointVector q = JointVector::Zero();         ///< rad, linear between the two samples
  JointVector velocity = JointVector::Zero();  ///< slope between the two samples [rad/s]
  Duration residual{};                         ///< distance in time to the nearer of the two samples
};

/// The last `capacity` joint samples.
/// Threads: one.
/// RT: push and interpolate are safe.
class JointHistory {
 public:
  /// Samples farther apart than `max_gap` are not interpolated.
  JointHistory(std::size_t capacity, Duration max_gap);

  /// A sample that is not newer than the last is ignored: interpolation needs increasing time.
  void push(const JointState& state) noexcept;

  /// Joints at `when`.
  /// Errors: kNotReady if `when` is newer than the newest sample (ask again later), kOutOfRange if older than the
  /// oldest kept, kRefused if the samples around it are further apart than max_gap. Never extrapolates.
  Result<SyncedJoints> interpolate(Stamp when) const noexcept;

  std::size_t size() const noexcept { return size_; }

 private:
  const JointState& at(std::size_t i) const noexcept { return ring_[(first_ + i) % ring_.size()]; }

  std::vector<JointState> ring_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  Duration max_gap_;
};

}  // namespace tankrig
