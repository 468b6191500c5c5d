// Whether the encoders follow the demands, or repeat an old reading.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig {

/// An encoder is frozen once it has repeated a reading for longer than `longest` while its joint was driven without
/// stall current; for half of that if the drive then ended. It stays frozen until its reading changes. An arm at rest
/// repeats its readings too, so a frozen encoder does not show whether its joint stands. Times are those of readings,
/// so silence does not count.
/// Threads: one.
/// RT: safe.
class MotionEvidence {
 public:
  static constexpr int kDrivenTicks = 50;  ///< slower demands may not move the joint [ticks/s]

  explicit MotionEvidence(Duration longest) : longest_(longest) {}

  /// From `now` on the joint is driven at `speed` [ticks/s], in either direction.
  void demand(std::size_t joint, int speed, Stamp now) noexcept {
    Encoder& e = encoders_[joint];
    const bool driven = speed >= kDrivenTicks;
    if (driven && !e.driven) e.since = now;
    if (!driven && e.driven && e.read - e.since > longest_ / 2) e.frozen = true;
    e.driven = driven;
  }

  /// A believed reading. `stalled`: the arm draws its stall current.
  void read(std::size_t joint, std::uint16_t raw, Stamp when, bool stalled) noexcept {
    Encoder& e = encoders_[joint];
    if (raw != e.raw) e.frozen = false;
    if (raw != e.raw || stalled) e.since = when;
    e.raw = raw;
    e.read = when;
    if (e.driven && when - e.since > longest_) e.frozen = true;
  }

  bool frozen() const noexcept {
    return std::any_of(encoders_.begin(), encoders_.end(), [](const Encoder& e) { return e.frozen; });
  }

 private:
  struct Encoder {
    std::uint16_t raw = 0;
    bool driven = false, frozen = false;
    Stamp since{};  ///< it has read the same, driven or about to be
    Stamp read{};   ///< its newest reading
  };

  Duration longest_;
  std::array<Encoder, kJoints> encoders_{};
};

}  // namespace tankrig
