// Which frames' stamps can be believed if the device's clock may be set or reset at any moment.
#pragma once

#include <cstdint>

#include "drivers/camera/clock_fit.hpp"

namespace tankrig {

/// A stamp is believed once a clock reading that began after its frame arrived agrees with the line that maps it. Two
/// readings that agree with each other and not with the line are a jump: the line starts again from them, and frames
/// possibly exposed before the second stay unsure, because neither line maps them.
/// Not noticed: a clock that jumps there and back between two readings, or by less than the line's own uncertainty.
/// Threads: one at a time.
class ClockTrust {
 public:
  enum class Word { kWait, kSure, kUnsure };

  /// Counts a new frame; returns its number, from 1.
  std::uint64_t add_frame() { return ++newest_; }
  /// Whether a frame waits for a reading.
  bool in_doubt() const { return newest_ != vouched_; }
  /// The newest frame that a reading beginning now can vouch for.
  std::uint64_t newest() const { return newest_; }

  /// A reading that began when `newest` was the newest frame. `keep`: add it to the line; a disagreeing one is added in
  /// any case. False: it disagrees, and the next one will show whether it was noise.
  bool add_reading(const ClockSample& reading, std::uint64_t newest, bool keep) {
    if (keep || !fit_.agrees(reading)) {
      const ClockFit::Verdict verdict = fit_.add(reading);
      if (verdict == ClockFit::Verdict::kOutlier) return false;
      if (verdict == ClockFit::Verdict::kJump) jumped_ = reading.host;
    }
    vouched_ = newest;
    sigma_ = reading.sigma;
    return true;
  }

  /// Verdict on frame number `frame`, which was not exposed before `earliest`.
  Word word(std::uint64_t frame, Stamp earliest) const {
    if (frame > vouched_) return Word::kWait;
    return earliest < jumped_ ? Word::kUnsure : Word::kSure;
  }

  /// By how much more than the line's uncertainty a clock may have jumped without any reading showing it.
  Duration sigma() const { return sigma_; }

  /// A sample of a clock that cannot be read, or a new device: nobody vouches for frames then.
  ClockFit& fit() { return fit_; }
  const ClockFit& fit() const { return fit_; }

 private:
  ClockFit fit_;
  std::uint64_t newest_ = 0, vouched_ = 0;
  Stamp jumped_{};    ///< no later than this
  Duration sigma_{};  ///< of the reading that vouches
};

}  // namespace tankrig
