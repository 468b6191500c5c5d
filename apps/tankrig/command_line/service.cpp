#include "apps/tankrig/command_line/service.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>

#include "drivers/can/owned_descriptor.hpp"

namespace tankrig::app {

ServiceNotice::ServiceNotice(Stamp now) : next_(now) {
  const char* const socket = std::getenv("NOTIFY_SOCKET");
  const char* const watchdog = std::getenv("WATCHDOG_USEC");
  const char* const process = std::getenv("WATCHDOG_PID");
  if (socket && (socket[0] == '/' || socket[0] == '@')) socket_ = socket;
  const long long us = watchdog ? std::atoll(watchdog) : 0;
  if (us > 0 && (!process || std::atoll(process) == ::getpid())) watchdog_ = std::chrono::microseconds{us};
  // A command before this one may have told systemd not to watch any more.
  tell(watchdog_ ? "READY=1\nWATCHDOG=1\nWATCHDOG_USEC=" + std::to_string(us) : "READY=1");
}

/// What follows takes its time and moves nothing: pictures, reconstruction, the report.
ServiceNotice::~ServiceNotice() {
  if (watchdog_) tell("WATCHDOG_USEC=0");
}

void ServiceNotice::alive(Stamp now) noexcept {
  if (!watchdog_ || now < next_) return;
  next_ = now + *watchdog_ / 3;
  tell("WATCHDOG=1");
}

void ServiceNotice::tell(const std::string& words) const noexcept {
  sockaddr_un address{};
  if (socket_.empty() || socket_.size() >= sizeof address.sun_path) return;
  address.sun_family = AF_UNIX;
  socket_.copy(address.sun_path, socket_.size());
  if (address.sun_path[0] == '@') address.sun_path[0] = 0;  // an abstract name
  const OwnedDescriptor door(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
  (void)!::sendto(door.get(), words.data(), words.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                  reinterpret_cast<const sockaddr*>(&address), size);
}

}  // namespace tankrig::app
