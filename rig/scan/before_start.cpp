#include "rig/scan/before_start.hpp"

#include <fmt/format.h>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr Duration kBoxOpens = std::chrono::seconds{1};  // usually within 200 ms

}  // namespace

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

void check_box_open(const SafetySettings& settings, const WatchdogBox& box, Clock& clock) {
  if (settings.heartbeat_output.kind == HeartbeatKind::kNone || !box.reads_enable()) return;
  for (const Stamp end = clock.now() + kBoxOpens; box.enabled(clock.now());) {
    if (clock.now() >= end)
      throw InputError(
          "safety: enable_input: the watchdog box is enabled though it gets no heartbeat, expected it open within a "
          "second: look for a bridged or welded contact; it would not open when the program dies");
    clock.sleep_until(clock.now() + std::chrono::milliseconds(5));
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
