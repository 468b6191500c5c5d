#include "core/utc.hpp"

#include <fmt/chrono.h>

#include <ctime>

namespace tankrig {

std::string utc_now() { return fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr))); }

std::optional<std::time_t> time_of_utc(const std::string& text) {
  std::tm then{};
  const char* const end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &then);
  return end && *end == '\0' && end == text.c_str() + text.size() ? std::optional(::timegm(&then)) : std::nullopt;
}

ClockPair read_clock_pair(const Clock& clock) noexcept {
  constexpr int kTries = 3;
  ClockPair pair;
  Duration best = Duration::max();
  for (int i = 0; i < kTries; ++i) {
    timespec wall{};
    const Stamp before = clock.now();
    clock_gettime(CLOCK_REALTIME, &wall);
    const Duration took = clock.now() - before;
    if (took >= best) continue;
    best = took;
    pair = {before + took / 2, static_cast<std::int64_t>(wall.tv_sec) * 1'000'000'000 + wall.tv_nsec};
  }
  return pair;
}

}  // namespace tankrig
