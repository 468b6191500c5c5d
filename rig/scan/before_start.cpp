#include "rig/scan/before_start.hpp"

#include <fmt/format.h>

#include "core/input_error.hpp"

namespace tankrig {

JointVector read_posture(Arm& arm, Clock& clock, Duration timeout) {
  const Stamp deadline = clock.now() + timeout;
  while (true) {
    const auto news = arm.try_read();
    const bool late = clock.now() >= deadline;
    if (!news.ok() && (late || news.error().code != ErrorCode::kTimeout)) throw InputError(describe(news.error()));
    if (news.ok() && news.value()) return news.value()->q;
    if (late) throw InputError(fmt::format("arm: found no joint state, expected one within {:g} s", seconds(timeout)));
    clock.sleep_until(clock.now() + arm.exchange_period());
  }
}

void check_laser_ready(const ScanSettings& settings, const Laser& laser, bool interlock_closed) {
  const double warm_up = seconds(laser.warm_up());
  if (warm_up > settings.capture.laser_warm_up + 1e-9)
    throw InputError(fmt::format("scan: laser_warm_up: found {:g} s, expected at least the laser's own {:g} s",
                                 settings.capture.laser_warm_up, warm_up));
  if (!interlock_closed) throw InputError(std::string("scan: ") + kInterlockOpen);
}

}  // namespace tankrig
