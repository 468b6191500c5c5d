// The laser relay in the rig file.
#include <fmt/format.h>

#include "core/settings_table.hpp"
#include "drivers/device_path.hpp"
#include "drivers/laser/relay_laser.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kByte{0, 255};

const Setting<RelayProtocol> kRelayProtocolRows[] = {
    {"on_byte", &RelayProtocol::on_byte, kByte, "switches on, and is echoed; the laboratory's power box"},
    {"off_byte", &RelayProtocol::off_byte, kByte, "switches off, and is echoed"},
    {"status_query", &RelayProtocol::status_query, kByte,
     "answered by what the contacts do; none: the box has no read-back"},
};
void check_bytes(const ConfigNode& node, const RelayProtocol& p) {
  if (p.on_byte == p.off_byte) node.fail("off_byte", "is the same as on_byte, expected two different bytes");
  if (p.status_query == p.on_byte || p.status_query == p.off_byte)
    node.fail("status_query", "is the same as on_byte or off_byte, expected a byte of its own");
}
constexpr SettingsTable<RelayProtocol> kRelayProtocol{kRelayProtocolRows, check_bytes};

const Setting<SerialSettings> kRelayLineRows[] = {
    {"device", &SerialSettings::device, "its serial line, or runtime/NAME for an emulated one", Need::kRequired},
    {"baud", &SerialSettings::baud, ConfigRange(50, 4e6), "of the line"},
};
constexpr SettingsTable<SerialSettings> kRelayLine{kRelayLineRows};

using Relay = RelayLaserSettings;
const Setting<Relay> kRelayRows[] = {
    {"driver",
     {[](const ConfigNode& node, const char* key, Relay&) { static_cast<void>(node.choice(key, {"relay"})); }, nullptr,
      "relay"},
     "the only one"},
    {"interlock", &Relay::interlock,
     "read: from the relay's status, needs `status_query`; wired: the program does not see the loop"},
    {"", &Relay::serial, kRelayLine},
    {"", &Relay::protocol, kRelayProtocol},
    {"warm_up_s", &Relay::warm_up, ConfigRange(0, 600), "from supply to light"},
    {"refresh_ms", &Relay::refresh, ConfigRange(0, 10000),
     "the command is sent again so often, for a relay with a watchdog; 0: once"},
    {"query_period_ms", &Relay::query_period, ConfigRange(5, 10000), "with a status query: contacts are read so often"},
    {"answer_timeout_ms", &Relay::answer_timeout, ConfigRange(5, 5000), "longest wait for an answer"},
    {"attempts", &Relay::attempts, ConfigRange(1, 10), "so many failed answers in a row: off, until it is set again"},
    {"caller_timeout_ms", &Relay::caller_timeout, ConfigRange(1, 60000),
     "so long without a request it is switched off; must be below the arm's watchdog_ms"},
    {"opening_timeout_s", &Relay::opening_timeout, ConfigRange(0.05, 60),
     "for a board that restarts when its line is opened"},
};

}  // namespace

constinit const SettingsTable<RelayLaserSettings> kRelayKeys{kRelayRows};

RelayLaserSettings relay_laser_settings_from(const ConfigNode& laser, const std::filesystem::path& runtime) {
  RelayLaserSettings s;
  read_settings(laser, kRelayKeys, s);
  s.serial.device = device_path(s.serial.device, runtime);
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
