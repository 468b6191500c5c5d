// The rig's devices as this machine sees them: CAN interface, serial lines, cameras, the network.
//
// Functions with a root folder read /proc, /sys and /dev below it: "/", or a copy in a test.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "core/time.hpp"
#include "drivers/can/can_link.hpp"
#include "rig/platform/finding.hpp"

namespace tankrig {

/// What the arm demands of its bus.
struct CanNeed {
  std::string interface;
  int bitrate = 0;         ///< [bit/s]
  double load = 0;         ///< share of the bus's time, [0, 1]
  int frames_at_once = 5;  ///< that the queue must hold
};

/// Traffic of an interface since it came up, both ways, as the kernel counts it.
struct CanTraffic {
  Stamp when{};
  std::uint64_t frames = 0, bytes = 0;
};

/// Nothing if there is no such interface.
std::optional<CanTraffic> can_traffic(const std::filesystem::path& root, const std::string& interface, Stamp now);

/// Share of the bus's time taken between the two counts, [0, 1]: frames with 11-bit identifiers and one stuff bit per
/// ten bits.
double bus_load(const CanTraffic& from, const CanTraffic& to, int bitrate) noexcept;

/// `link`: read_can_link() of the interface; nothing if it is no controller.
/// `others`: bus_load() while this program sent nothing; nothing if it was not measured.
Finding can_finding(const std::filesystem::path& root, const CanNeed& need, const std::optional<CanLink>& link,
                    std::optional<double> others = {});

/// `what`: "laser", "arm", ...; `device`: an absolute path. Good if this user may read and write it and nobody else has
/// it open.
Finding serial_finding(const std::filesystem::path& root, const std::string& what, const std::string& device);

/// A Video for Linux device that this user may open.
Finding v4l2_finding(const std::filesystem::path& root, const std::string& camera, const std::string& device);

/// Compares the largest receive buffer a program may have with 0.2 s of the GigE cameras' data [bytes/s].
Finding receive_buffer_finding(const std::filesystem::path& root, double bytes_per_s);

/// Compares the MTU of the interface whose network contains `address` (IPv4) with the camera's packet; nothing if there
/// is no such interface.
Finding mtu_finding(const std::string& camera, const std::string& interface, int mtu, int packet_bytes);

struct NetworkInterface {
  std::string name;
  int mtu = 0;
};
std::optional<NetworkInterface> interface_towards(const std::string& address);

}  // namespace tankrig
