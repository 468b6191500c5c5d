#include "core/clock.hpp"

#include <cerrno>
#include <ctime>

namespace tankrig {
namespace {

Stamp read(clockid_t clock) noexcept {
  timespec t{};
  clock_gettime(clock, &t);
  return {static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec};
}

}  // namespace

Stamp MonotonicClock::now() const noexcept { return read(CLOCK_MONOTONIC); }

/// CLOCK_BOOTTIME is read between two readings of the other: a thread that loses its processor in here widens the
/// bounds, and moves neither beyond the truth.
TimeAsleep MonotonicClock::asleep() const noexcept {
  const Stamp before = read(CLOCK_MONOTONIC), boot = read(CLOCK_BOOTTIME), after = read(CLOCK_MONOTONIC);
  return {boot - after, boot - before};
}

const MonotonicClock& MonotonicClock::one() noexcept {
  static const MonotonicClock clock;
  return clock;
}

void MonotonicClock::sleep_until(Stamp when) noexcept {
  const timespec t{static_cast<time_t>(when.ns / 1'000'000'000), static_cast<long>(when.ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace tankrig
