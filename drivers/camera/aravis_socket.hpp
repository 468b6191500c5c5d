// Which kind of socket receives a camera's frames on this machine, and how large its buffer must be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "drivers/camera/aravis_camera.hpp"

namespace tankrig {

struct SocketLimits {
  std::size_t buffer_bytes = 0;  ///< the largest receive buffer this process may ask for (net.core.rmem_max)
  bool packet_sockets = false;   ///< CAP_NET_RAW
};

/// Asks the system.
/// Threads: any.
SocketLimits socket_limits();

struct SocketPlan {
  bool packet = false;
  int buffer_bytes = 0;  ///< of a datagram socket
};

/// A datagram socket if its buffer may hold two frames (eight if the system allows): it is faster. Otherwise a packet
/// socket. With the default buffer nearly every frame loses packets.
/// Errors: InputError with the command that cures it.
SocketPlan plan_socket(const std::string& camera, AravisSettings::Socket wanted, std::size_t frame_bytes,
                       const SocketLimits& limits);

/// Gives this process's datagram socket at `port` a receive buffer of at least `bytes`, or what the system allows.
/// Aravis does so only after a stream's first packet, when the rest of its frame may be lost already, and does not
/// expose the socket. False if there is none.
bool enlarge_receive_buffer(std::uint16_t port, int bytes);

}  // namespace tankrig
