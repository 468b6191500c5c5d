#include "drivers/can/open_can.hpp"

#include "drivers/can/can_socket.hpp"
#include "drivers/device_path.hpp"

namespace tankrig {

CanSettings can_settings_from(const ConfigNode& node, const std::filesystem::path& runtime) {
  constexpr std::string_view kHub = "unix:";
  CanSettings s;
  s.interface = node.text("interface");
  if (s.interface.starts_with(kHub))
    s.interface = std::string(kHub) + device_path(s.interface.substr(kHub.size()), runtime);
  s.bitrate = node.integer_or("bitrate_bit_s", s.bitrate, {10'000, 1'000'000});
  s.check_bitrate = true;
  s.receive_buffer_bytes = node.integer_or("receive_buffer_bytes", s.receive_buffer_bytes, {4096, 1 << 28});
  s.reopen_period = from_seconds(node.number_or("reopen_period_s", seconds(s.reopen_period), {0.001, 60}));
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
