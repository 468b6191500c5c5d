// Wall time: for people, and to relate a run's stamps to it. Nothing is computed with it.
#pragma once

#include <ctime>
#include <optional>
#include <string>

#include "core/clock.hpp"

namespace tankrig {

/// Now, as "2026-01-31T12:00:00Z".
std::string utc_now();

/// Of such a text; nothing if it is none.
std::optional<std::time_t> time_of_utc(const std::string& text);

/// Wall time of t = wall_ns + (t - stamp), until somebody sets the wall clock.
struct ClockPair {
  Stamp stamp{};             ///< of the run's clock
  std::int64_t wall_ns = 0;  ///< CLOCK_REALTIME, nanoseconds since 1970 UTC

  std::int64_t offset_ns() const noexcept { return wall_ns - stamp.ns; }
};

/// Reads both clocks close together: the closest of a few tries, commonly within a microsecond.
/// RT: safe.
ClockPair read_clock_pair(const Clock& clock) noexcept;

}  // namespace tankrig
