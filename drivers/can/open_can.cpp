#include "drivers/can/open_can.hpp"

#include "core/settings_table.hpp"
#include "drivers/can/can_socket.hpp"
#include "drivers/device_path.hpp"

namespace tankrig {

namespace {

const Setting<CanSettings> kCanRows[] = {
    {"interface", &CanSettings::interface, "can0, or unix:PATH of a bus that spans processes ([can.md](can.md))",
     Need::kRequired},
    {"bitrate_bit_s", &CanSettings::bitrate, ConfigRange(10'000, 1'000'000),
     "a controller that runs at another is refused"},
    {"receive_buffer_bytes", &CanSettings::receive_buffer_bytes, ConfigRange(4096, 1 << 28), "of the socket"},
    {"reopen_period_s", &CanSettings::reopen_period, ConfigRange(0.001, 60),
     "how often to look for an interface that went away"},
};

}  // namespace

constinit const SettingsTable<CanSettings> kCanKeys{kCanRows};

CanSettings can_settings_from(const ConfigNode& node, const std::filesystem::path& runtime) {
  constexpr std::string_view kHub = "unix:";
  CanSettings s;
  read_settings(node, kCanKeys, s);
  if (s.interface.starts_with(kHub))
    s.interface = std::string(kHub) + device_path(s.interface.substr(kHub.size()), runtime);
  s.check_bitrate = true;
  return s;
}

std::unique_ptr<CanBus> open_can(const CanSettings& settings, const Clock& clock) {
  return std::make_unique<CanSocket>(CanCarrier::open(settings), settings, clock);
}

std::pair<std::unique_ptr<CanBus>, std::unique_ptr<CanBus>> make_can_pair(const Clock& clock) {
  auto [a, b] = CanCarrier::pair();
  return {std::make_unique<CanSocket>(std::move(a), CanSettings{}, clock),
          std::make_unique<CanSocket>(std::move(b), CanSettings{}, clock)};
}

}  // namespace tankrig
