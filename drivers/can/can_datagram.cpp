#include "drivers/can/can_datagram.hpp"

#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

namespace tankrig {
namespace {

template <class T>
T value_of(const cmsghdr* c) noexcept {
  T value{};
  if (c->cmsg_len >= CMSG_LEN(sizeof value)) std::memcpy(&value, CMSG_DATA(c), sizeof value);
  return value;
}

}  // namespace

CanDatagram receive_datagram(int descriptor) noexcept {
  struct {
    canfd_frame frame;
    std::uint8_t excess;  // makes a datagram that is too long tell itself apart
  } buffer{};
  iovec part{&buffer, sizeof buffer};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))];
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;

  CanDatagram datagram;
  datagram.bytes = ::recvmsg(descriptor, &message, MSG_DONTWAIT);
  if (datagram.bytes < 0) {
    datagram.error = errno;
    return datagram;
  }
  datagram.frame = buffer.frame;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMPNS) datagram.wall = value_of<timespec>(c);
    if (c->cmsg_type == SO_RXQ_OVFL) datagram.drops = value_of<std::uint32_t>(c);
  }
  return datagram;
}

bool at_end(int descriptor) noexcept {
  int waiting = 0;
  pollfd end{descriptor, POLLRDHUP, 0};
  return ::poll(&end, 1, 0) > 0 && (end.revents & (POLLRDHUP | POLLHUP)) &&
         ::ioctl(descriptor, SIOCINQ, &waiting) == 0 && waiting == 0;
}

void enable_reports(int descriptor) noexcept {
  const int on = 1;
  ::setsockopt(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  ::setsockopt(descriptor, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
}

}  // namespace tankrig
