// Which kind of socket takes a camera's frames on this machine, and how large its buffer must be.
#pragma once

#include <cstddef>
#include <string>

#include "drivers/camera/aravis_camera.hpp"

namespace tankrig {

struct SocketLimits {
  std::size_t buffer_bytes = 0;  ///< the largest receive buffer this process may ask for (net.core.rmem_max)
  bool packet_sockets = false;   ///< CAP_NET_RAW
};

/// Asks the system. Threads: any.
SocketLimits socket_limits();

struct SocketPlan {
  bool packet = false;
  int buffer_bytes = 0;  ///< of a datagram socket
};

/// An ordinary socket whose buffer holds two frames (eight, where the system allows that): it is the faster one; else a
/// packet socket. With the default buffer nearly every frame loses packets. Errors: InputError with the command that
/// cures it.
SocketPlan plan_socket(const std::string& camera, AravisSettings::Socket wanted, std::size_t frame_bytes,
                       const SocketLimits& limits);

}  // namespace tankrig
