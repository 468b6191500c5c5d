// Extends a device's 32-bit picture count to 64 bits, across wraps, repeats and restarts.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/time.hpp"

namespace tankrig {

/// Threads: one.
/// RT: safe.
class V4l2Sequence {
 public:
  struct Place {
    std::uint64_t number = 0;
    std::uint64_t missed = 0;  ///< pictures between this one and the last
  };

  /// If the count stands still or runs backwards (the device does not count, or restarted), the stamps decide, unless
  /// `period` is zero.
  Place place(std::uint32_t counted, Stamp stamp, Duration period) noexcept {
    const std::uint32_t ahead = last_ ? counted - *last_ : 0;
    std::uint64_t step = ahead;
    if (ahead == 0 || ahead > kBackwards) step = any_ ? 1 + pictures_between(last_stamp_, stamp, period) : 0;
    const Place place{number_ + step, step > 0 ? step - 1 : 0};
    last_ = counted;
    last_stamp_ = stamp;
    number_ = place.number;
    any_ = true;
    return place;
  }

  /// The device counts from the beginning again: the stamps tell what is missing.
  void restart() noexcept { last_.reset(); }
  /// Nobody wanted what it exposed meanwhile: nothing is missing.
  void begin_anew() noexcept {
    last_.reset();
    last_stamp_ = kNever;
  }

 private:
  static constexpr std::uint32_t kBackwards = 1u << 31;
  static constexpr Stamp kNever{std::numeric_limits<std::int64_t>::max()};

  static std::uint64_t pictures_between(Stamp a, Stamp b, Duration period) noexcept {
    if (period.count() <= 0 || b <= a) return 0;
    const double periods = std::round(static_cast<double>((b - a).count()) / static_cast<double>(period.count()));
    return periods > 1 ? static_cast<std::uint64_t>(periods) - 1 : 0;
  }

  std::optional<std::uint32_t> last_;
  Stamp last_stamp_{};
  std::uint64_t number_ = 0;
  bool any_ = false;
};

}  // namespace tankrig
