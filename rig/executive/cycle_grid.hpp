// The cycle's time grid: fixed period, counted overruns, no burst of late cycles.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/time.hpp"

namespace tankrig {

/// Grid points start + n * period. A cycle that ends after the next point drops the points it ran over.
/// RT: safe.
class CycleGrid {
 public:
  CycleGrid(Stamp start, Duration period) : next_(start), period_(period) {}

  Stamp next() const noexcept { return next_; }

  /// Moves to the first later grid point that is not yet past at `now`. True if points were dropped: an overrun.
  bool advance(Stamp now) noexcept {
    next_ = next_ + period_;
    if (now <= next_) return false;
    const std::int64_t missed = (now - next_ + period_ - Duration{1}) / period_;
    next_ = next_ + period_ * missed;
    ++overruns_;
    missed_ += static_cast<std::uint64_t>(missed);
    return true;
  }

  /// Goes on from `start`.
  void restart(Stamp start) noexcept { next_ = start; }
  /// Delays the next point and all after it by this.
  void shift(Duration by) noexcept { next_ = next_ + by; }

  std::uint64_t overruns() const noexcept { return overruns_; }     ///< cycles that ran past the next grid point
  std::uint64_t missed_cycles() const noexcept { return missed_; }  ///< grid points dropped for it

 private:
  Stamp next_;
  Duration period_;
  std::uint64_t overruns_ = 0, missed_ = 0;
};

/// Steers a grid so that it keeps its phase to a device that samples by its own clock. A fixed grid would now and then
/// meet two samples in a cycle, or none. A device that answers on request is always in phase.
/// RT: safe.
class PhaseLock {
 public:
  explicit PhaseLock(Duration period) : period_(period) {}

  /// `age` of the newest sample as a cycle begins; returns by how much to delay the next one. Half a period is
  /// corrected within a hundred cycles; a quarter, as from jitter, is left alone.
  Duration steer(Duration age) noexcept {
    youngest_ = std::min(youngest_, age);
    Duration off = (age - youngest_ - period_ / 8) % period_;
    if (off > period_ / 2) off -= period_;
    if (off > period_ / 4) return -period_ / 200;
    if (off < -period_ / 4) return period_ / 200;
    return Duration{0};
  }

 private:
  Duration period_;
  Duration youngest_ = Duration::max();
};

/// Whether there were `limit` overruns within `window`.
/// RT: add() is safe.
class OverrunWindow {
 public:
  /// A limit of 0 is never reached.
  OverrunWindow(int limit, Duration window) : past_(static_cast<std::size_t>(limit)), window_(window) {}

  /// Adds one at `when`; true if the limit is reached.
  bool add(Stamp when) noexcept {
    if (past_.empty()) return false;
    past_[count_++ % past_.size()] = when;
    return count_ >= past_.size() && when - past_[count_ % past_.size()] <= window_;
  }

 private:
  std::vector<Stamp> past_;  // the newest ones, in a ring
  Duration window_;
  std::size_t count_ = 0;
};

}  // namespace tankrig
