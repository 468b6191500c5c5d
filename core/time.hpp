// Time on the rig: one clock, nanoseconds, no wall time.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>

namespace tankrig {

using Duration = std::chrono::nanoseconds;

/// An instant of CLOCK_MONOTONIC (or of the virtual clock that stands in for it), int64 nanoseconds.
/// Device clocks never leave their driver; a frame's stamp is the middle of its exposure.
struct Stamp {
  std::int64_t ns = 0;

  friend constexpr auto operator<=>(const Stamp&, const Stamp&) = default;
  friend constexpr Stamp operator+(Stamp t, Duration d) { return {t.ns + d.count()}; }
  friend constexpr Stamp operator-(Stamp t, Duration d) { return {t.ns - d.count()}; }
  friend constexpr Duration operator-(Stamp a, Stamp b) { return Duration{a.ns - b.ns}; }
};

constexpr double seconds(Duration d) { return static_cast<double>(d.count()) * 1e-9; }

/// Nearest nanosecond to `s` seconds.
constexpr Duration from_seconds(double s) {
  return Duration{static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5))};
}

}  // namespace tankrig
