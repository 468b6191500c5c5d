#include "drivers/camera/aravis_socket.hpp"

#include <fmt/format.h>
#include <linux/if_packet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastBuffer = 1 << 20, kMostBuffer = 1 << 30;

/// Of a datagram socket on IPv4; 0: it is something else.
std::uint16_t port_of(int fd) {
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return 0;
  sockaddr_in at{};
  size = sizeof at;
  if (::getsockname(fd, reinterpret_cast<sockaddr*>(&at), &size) != 0 || at.sin_family != AF_INET) return 0;
  return ntohs(at.sin_port);
}

}  // namespace

SocketLimits socket_limits() {
  SocketLimits limits;
  // A network namespace has no file that tells its limit; the kernel cuts what is asked for, and reports it doubled.
  if (const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0); fd >= 0) {
    int bytes = 1 << 30;
    socklen_t size = sizeof bytes;
    ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    if (::getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, &size) == 0)
      limits.buffer_bytes = static_cast<std::size_t>(bytes) / 2;
    ::close(fd);
  }
  if (const int fd = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0); fd >= 0) {
    limits.packet_sockets = true;
    ::close(fd);
  }
  return limits;
}

SocketPlan plan_socket(const std::string& camera, AravisSettings::Socket wanted, std::size_t frame_bytes,
                       const SocketLimits& limits) {
  using Socket = AravisSettings::Socket;
  const std::size_t needed = std::max(2 * frame_bytes, kLeastBuffer);
  const std::size_t wished = std::max(8 * frame_bytes, kLeastBuffer);  // memory is taken only while packets wait
  const auto refuse = [&](const std::string& reason) -> SocketPlan {
    throw InputError("camera " + camera + ": " + reason);
  };
  if (wanted == Socket::kPacket) {
    if (!limits.packet_sockets) return refuse("socket packet needs CAP_NET_RAW: run as root, or use socket datagram");
    return {true, 0};
  }
  if (limits.buffer_bytes >= needed)
    return {false, static_cast<int>(std::min({wished, limits.buffer_bytes, kMostBuffer}))};
  if (wanted == Socket::kAuto && limits.packet_sockets) return {true, 0};
  return refuse(fmt::format(
      "two frames need a socket buffer of {0} bytes, the system allows {1}: sysctl -w net.core.rmem_max={0}{2}", needed,
      limits.buffer_bytes, limits.packet_sockets ? ", or use socket packet" : ", or run with CAP_NET_RAW"));
}

bool enlarge_receive_buffer(std::uint16_t port, int bytes) {
  std::error_code none;
  bool found = false;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", none)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    if (port == 0 || port_of(fd) != port) continue;
    found = true;
    int has = 0;
    socklen_t size = sizeof has;
    if (::getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &has, &size) == 0 && has / 2 < bytes)  // the kernel reports it doubled
      ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  }
  return found;
}

}  // namespace tankrig
