// The laser relay in the rig file.
#include <fmt/format.h>

#include "drivers/device_path.hpp"
#include "drivers/laser/relay_laser.hpp"

namespace tankrig {
RelayProtocol relay_protocol_from(const ConfigNode& laser) {
  RelayProtocol p;
  p.on_byte = static_cast<std::uint8_t>(laser.integer_or("on_byte", p.on_byte, {0, 255}));
  p.off_byte = static_cast<std::uint8_t>(laser.integer_or("off_byte", p.off_byte, {0, 255}));
  if (laser.has("status_query")) p.status_query = static_cast<std::uint8_t>(laser.integer("status_query", {0, 255}));
  if (p.on_byte == p.off_byte) laser.fail("off_byte", "is the same as on_byte, expected two different bytes");
  if (p.status_query == p.on_byte || p.status_query == p.off_byte)
    laser.fail("status_query", "is the same as on_byte or off_byte, expected a byte of its own");
  return p;
}

RelayLaserSettings relay_laser_settings_from(const ConfigNode& laser, const std::filesystem::path& runtime) {
  RelayLaserSettings s;
  s.serial.device = device_path(laser.text("device"), runtime);
  s.serial.baud = laser.integer_or("baud", s.serial.baud, {50, 4e6});
  s.protocol = relay_protocol_from(laser);
  s.warm_up = from_seconds(laser.number_or("warm_up_s", seconds(s.warm_up), {0, 600}));
  s.refresh = laser.milliseconds_or("refresh_ms", s.refresh, {0, 10000});
  s.query_period = laser.milliseconds_or("query_period_ms", s.query_period, {5, 10000});
  s.answer_timeout = laser.milliseconds_or("answer_timeout_ms", s.answer_timeout, {5, 5000});
  s.attempts = laser.integer_or("attempts", s.attempts, {1, 10});
  s.caller_timeout = laser.milliseconds_or("caller_timeout_ms", s.caller_timeout, {1, 60000});
  s.opening_timeout = from_seconds(laser.number_or("opening_timeout_s", seconds(s.opening_timeout), {0.05, 60}));
  return s;
}

void check_goes_off_first(const ConfigNode& laser, const RelayLaserSettings& settings, Duration arm_watchdog) {
  if (settings.caller_timeout < arm_watchdog) return;
  const auto ms = [](Duration d) { return d / std::chrono::milliseconds{1}; };
  laser.fail(
      "caller_timeout_ms",
      fmt::format("found {}, expected less than the arm's watchdog_ms ({}): where the cycle hangs the laser goes "
                  "off first",
                  ms(settings.caller_timeout), ms(arm_watchdog)));
}

}  // namespace tankrig
