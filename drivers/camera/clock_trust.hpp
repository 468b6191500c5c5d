// Which frames' stamps may be believed, of a device whose clock may be set or reset at any moment.
#pragma once

#include <cstdint>

#include "drivers/camera/clock_fit.hpp"

namespace tankrig {

/// A stamp is believed when a reading of the device's clock that began after its frame had come agrees with the line
/// that maps it. Two readings that agree with each other and not with the line are a jump: the line begins anew with
/// them, and what may have been exposed before the second is unsure for good, its frame being mapped by neither line.
/// Not noticed: a clock that jumps and jumps back between two readings, or by less than the line itself is known.
/// Threads: one at a time.
class ClockTrust {
 public:
  enum class Word { kWait, kSure, kUnsure };

  /// A frame has come. Its number, from 1.
  std::uint64_t add_frame() { return ++newest_; }
  /// A frame waits for a reading.
  bool in_doubt() const { return newest_ != vouched_; }
  /// The newest frame that a reading which begins now can vouch for.
  std::uint64_t newest() const { return newest_; }

  /// A reading that began when `newest` was the newest frame. `keep`: it is to become part of the line; one that
  /// disagrees does in any case. False: it disagrees, and the next one will say whether it was noise.
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

  /// Of frame number `frame`, which was not exposed before `earliest`.
  Word word(std::uint64_t frame, Stamp earliest) const {
    if (frame > vouched_) return Word::kWait;
    return earliest < jumped_ ? Word::kUnsure : Word::kSure;
  }

  /// A clock may have jumped by so much more than the line is unsure, and no reading would have shown it.
  Duration sigma() const { return sigma_; }

  /// A sample of a clock that cannot be asked, or another device: nobody vouches for frames then.
  ClockFit& fit() { return fit_; }
  const ClockFit& fit() const { return fit_; }

 private:
  ClockFit fit_;
  std::uint64_t newest_ = 0, vouched_ = 0;
  Stamp jumped_{};    ///< no later than this
  Duration sigma_{};  ///< of the reading that vouches
};

}  // namespace tankrig
