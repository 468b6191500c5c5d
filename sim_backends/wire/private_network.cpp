#include "sim_backends/wire/private_network.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "core/clock.hpp"

namespace tankrig::sim {
namespace {

Error failure(const char* where) { return {ErrorCode::kRefused, errno, MonotonicClock{}.now(), where}; }

bool write_text(const char* file, const std::string& text) {
  const int fd = ::open(file, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool ok = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  ::close(fd);
  return ok;
}

Status unshare_as_user() {
  const std::string user = std::to_string(::geteuid()), group = std::to_string(::getegid());
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    if (errno == EINVAL) return failure("private network: must be entered before the first thread is started");
    return failure(
        "private network: user namespaces are forbidden here (sysctl kernel.unprivileged_userns_clone, "
        "user.max_user_namespaces, or a container's policy)");
  }
  if (!write_text("/proc/self/setgroups", "deny")) return failure("private network: /proc/self/setgroups");
  if (!write_text("/proc/self/uid_map", user + " " + user + " 1"))
    return failure("private network: /proc/self/uid_map");
  if (!write_text("/proc/self/gid_map", group + " " + group + " 1"))
    return failure("private network: /proc/self/gid_map");
  return {};
}

Status loopback_up(int addresses) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return failure("private network: no IPv4 sockets");
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK;
  Status status;
  if (::ioctl(fd, SIOCSIFFLAGS, &request) != 0) status = failure("private network: loopback up");
  for (int i = 2; i <= addresses && status.ok(); ++i) {
    ifreq alias{};
    std::snprintf(alias.ifr_name, sizeof alias.ifr_name, "lo:%d", i);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + static_cast<std::uint32_t>(i));
    std::memcpy(&alias.ifr_addr, &address, sizeof address);
    if (::ioctl(fd, SIOCSIFADDR, &alias) != 0) status = failure("private network: addresses of the loopback");
  }
  ::close(fd);
  return status;
}

}  // namespace

Status enter_private_network(int addresses) {
  if (::geteuid() != 0 || ::unshare(CLONE_NEWNET) != 0)
    if (const Status status = unshare_as_user(); !status.ok()) return status;
  return loopback_up(addresses);
}

}  // namespace tankrig::sim
