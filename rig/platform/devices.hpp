// The rig's devices as this machine sees them: CAN interface, serial lines, cameras, the network.
//
// Functions of a root folder read /proc, /sys and /dev below it: "/", or a copy in a test.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "drivers/can/can_link.hpp"
#include "rig/platform/finding.hpp"

namespace tankrig {

/// What the arm asks of its bus.
struct CanNeed {
  std::string interface;
  int bitrate = 0;         ///< [bit/s]
  double load = 0;         ///< share of the bus's time, [0, 1]
  int frames_at_once = 5;  ///< that the queue must hold
};

/// `link`: what the kernel tells of the interface, read_can_link(); nothing for what is not a controller.
Finding can_finding(const std::filesystem::path& root, const CanNeed& need, const std::optional<CanLink>& link);

/// `what`: "laser", "arm", ...; `device`: an absolute path. Good if this user may read and write it and nobody has it.
Finding serial_finding(const std::filesystem::path& root, const std::string& what, const std::string& device);

/// A Video for Linux device that this user may open.
Finding v4l2_finding(const std::filesystem::path& root, const std::string& camera, const std::string& device);

/// The largest receive buffer a program may have, against 0.2 s of what GigE cameras deliver [bytes/s].
Finding receive_buffer_finding(const std::filesystem::path& root, double bytes_per_s);

/// MTU of the interface whose network holds `address` (IPv4), against the camera's packet; nothing if there is no such
/// interface.
Finding mtu_finding(const std::string& camera, const std::string& interface, int mtu, int packet_bytes);

struct NetworkInterface {
  std::string name;
  int mtu = 0;
};
std::optional<NetworkInterface> interface_towards(const std::string& address);

}  // namespace tankrig
