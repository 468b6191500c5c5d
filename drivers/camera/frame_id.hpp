// A camera's frame numbers, unwrapped: losses between two frames, and restarts of the camera.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tankrig {

/// Turns GigE Vision block ids into an increasing sequence. A 16-bit id runs 1 .. 65535, then 1 again (0 means "no
/// frame"); a 64-bit extended id never wraps. An id a few places back is a late frame; one farther back is a restarted
/// camera. A loss of more than 32767 frames between two 16-bit ids looks like a restart.
class FrameIdSequence {
 public:
  enum class Width { k16, k64 };

  struct Step {
    std::uint64_t sequence = 0;  ///< 0 for the first frame
    std::uint64_t lost = 0;      ///< ids skipped since the newest frame
    bool restarted = false;      ///< the camera restarted: losses meanwhile are unknown, the sequence goes on
    bool late = false;           ///< older than the newest frame, or a repeat of it
  };

  explicit FrameIdSequence(Width width = Width::k16) : width_(width) {}

  /// `unnumbered`: frames since the newest one whose number was lost; they do not count as lost.
  Step next(std::uint64_t id, std::uint64_t unnumbered = 0) noexcept {
    if (anew_) {
      const bool again = begun_;
      sequence_ = (begun_ ? sequence_ + 1 : 0) + unnumbered;
      begun_ = true;
      anew_ = false;
      last_id_ = id;
      return {sequence_, 0, again, false};
    }
    const std::uint64_t ahead = forward(last_id_, id);
    const std::uint64_t behind = forward(id, last_id_);
    if (ahead == 0 || behind <= kLate) return {behind <= sequence_ ? sequence_ - behind : 0, 0, false, true};
    last_id_ = id;
    if (ahead > (width_ == Width::k16 ? kFarthest16 : kFarthest64))
      return {sequence_ += 1 + unnumbered, 0, true, false};
    sequence_ += ahead;
    return {sequence_, ahead - 1 - std::min(ahead - 1, unnumbered), false, false};
  }

  /// The next id is the first of a camera that was switched on or reopened.
  void restart() noexcept { anew_ = true; }

 private:
  static constexpr std::uint64_t kIds = 65535;                                  ///< values of a 16-bit id
  static constexpr std::uint64_t kFarthest16 = 32767, kFarthest64 = ~0ull / 2;  ///< frames; beyond is a restart
  static constexpr std::uint64_t kLate = 4;  ///< frames that may overtake one another on the wire

  std::uint64_t forward(std::uint64_t from, std::uint64_t to) const noexcept {
    if (width_ == Width::k64) return to - from;
    return (to % kIds + kIds - from % kIds) % kIds;
  }

  Width width_;
  std::uint64_t last_id_ = 0, sequence_ = 0;
  bool begun_ = false, anew_ = true;
};

}  // namespace tankrig
