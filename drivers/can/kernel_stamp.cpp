#include "drivers/can/kernel_stamp.hpp"

#include <algorithm>

namespace tankrig {
namespace {

std::int64_t nanoseconds(const timespec& t) { return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec; }

/// Wall time minus the rig's. A thread may lose the processor between the readings: the closest of a few is taken.
std::int64_t wall_offset(const Clock& clock, Stamp& now) noexcept {
  constexpr int kTries = 3;
  constexpr Duration kClose = std::chrono::microseconds(2);
  std::int64_t offset = 0;
  Duration best = Duration::max();
  for (int i = 0; i < kTries && best > kClose; ++i) {
    timespec wall{};
    const Stamp before = clock.now();
    ::clock_gettime(CLOCK_REALTIME, &wall);
    now = clock.now();
    if (now - before >= best) continue;
    best = now - before;
    offset = nanoseconds(wall) - (before + best / 2).ns;
  }
  return offset;
}

}  // namespace

Stamp StampConverter::operator()(const std::optional<timespec>& wall) noexcept {
  Stamp stamp = clock_.now();
  if (wall && clock_.real_time()) {
    Stamp now = stamp;
    stamp.ns = nanoseconds(*wall) - wall_offset(clock_, now);
    stamp = std::min(stamp, now);
  }
  return last_ = std::max(last_, stamp);
}

}  // namespace tankrig
