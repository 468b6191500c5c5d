#include "core/clock.hpp"

#include <cerrno>
#include <ctime>

namespace tankrig {

Stamp MonotonicClock::now() const noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return {static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec};
}

void MonotonicClock::sleep_until(Stamp when) noexcept {
  const timespec t{static_cast<time_t>(when.ns / 1'000'000'000), static_cast<long>(when.ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace tankrig
