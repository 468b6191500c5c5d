// The cycle's time grid: fixed period, counted overruns, never a burst of late cycles.
#pragma once

#include <cstdint>

#include "core/time.hpp"

namespace tankrig {

/// Grid points start + n * period. A cycle that ends after its successor's point drops the points it ran over.
/// RT: safe.
class CycleGrid {
 public:
  CycleGrid(Stamp start, Duration period) : next_(start), period_(period) {}

  Stamp next() const noexcept { return next_; }

  /// Moves to the first grid point after the one just served that is not yet past at `now`.
  void advance(Stamp now) noexcept {
    next_ = next_ + period_;
    if (now <= next_) return;
    const std::int64_t missed = (now - next_ + period_ - Duration{1}) / period_;
    next_ = next_ + period_ * missed;
    ++overruns_;
    missed_ += static_cast<std::uint64_t>(missed);
  }

  std::uint64_t overruns() const noexcept { return overruns_; }     ///< cycles that ran past the next grid point
  std::uint64_t missed_cycles() const noexcept { return missed_; }  ///< grid points dropped for it

 private:
  Stamp next_;
  Duration period_;
  std::uint64_t overruns_ = 0, missed_ = 0;
};

}  // namespace tankrig
