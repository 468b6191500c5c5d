// One message of a CAN socket, as the kernel hands it over.
#pragma once

#include <linux/can.h>
#include <sys/types.h>

#include <cstdint>
#include <ctime>
#include <optional>

namespace tankrig {

struct CanDatagram {
  canfd_frame frame{};  ///< a classic frame has the same layout, and eight bytes at most
  ssize_t bytes = 0;    ///< -1: `error` says why; 0: empty, or the end of the carrier
  int error = 0;
  std::optional<timespec> wall;        ///< reception by CLOCK_REALTIME, where the carrier stamps (SO_TIMESTAMPNS)
  std::optional<std::uint32_t> drops;  ///< frames the socket has lost since it was opened, if any (SO_RXQ_OVFL)

  bool classic() const noexcept { return bytes == CAN_MTU && frame.len <= CAN_MAX_DLEN; }
  bool fd() const noexcept { return bytes == CANFD_MTU && frame.len <= CANFD_MAX_DLEN; }
};

/// Never blocks; EAGAIN if none waits.
/// RT: safe.
CanDatagram receive_datagram(int descriptor) noexcept;

/// Whether, after an empty datagram, the other side sends no more and everything has been read.
/// RT: safe.
bool at_end(int descriptor) noexcept;

/// Requests stamps and drop counts with each datagram.
void enable_reports(int descriptor) noexcept;

}  // namespace tankrig
