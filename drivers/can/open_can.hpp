// Opens a CAN bus: a kernel interface ("can0"), a bus that spans processes ("unix:PATH"), or a pair in this process.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.hpp"
#include "core/config_node.hpp"
#include "drivers/can/can_bus.hpp"

namespace tankrig {

/// Accepts a standard data frame whose id equals `id` in the bits of `mask`.
struct CanFilter {
  std::uint16_t id = 0;
  std::uint16_t mask = 0x7FF;
};

struct CanSettings {
  std::string interface = "can0";  ///< "can0", or "unix:/path" of a hub (sim_backends/wire/can_hub.hpp)
  int bitrate = 500'000;           ///< [bit/s]
  std::vector<CanFilter> filters;  ///< any of them accepts; empty: every standard data frame
  int receive_buffer_bytes = 1 << 20;
  int send_queue_frames = 64;  ///< about, on "unix:" only; an interface's is `ip link set can0 txqueuelen`
  Duration reopen_period = std::chrono::milliseconds(100);  ///< how often to look for an interface that went away
  bool check_bitrate = false;  ///< refuse a controller that runs at another; from a rig file: yes
};

extern const SettingsTable<CanSettings> kCanKeys;

/// "unix:runtime/NAME" lies in `runtime`. The filters are the device's, not the file's.
CanSettings can_settings_from(const ConfigNode& node, const std::filesystem::path& runtime);

/// Errors: InputError that says what to do: no such interface, down, another bit rate, listen-only, no CAN in this
/// kernel, no permission, no hub.
/// `clock` outlives the bus.
std::unique_ptr<CanBus> open_can(const CanSettings& settings, const Clock& clock);

/// Two nodes of a bus without a wire, in this process. Each may move to its own thread or forked process.
std::pair<std::unique_ptr<CanBus>, std::unique_ptr<CanBus>> make_can_pair(const Clock& clock);

}  // namespace tankrig
