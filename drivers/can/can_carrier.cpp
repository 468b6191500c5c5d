#include "drivers/can/can_carrier.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "core/input_error.hpp"
#include "drivers/can/can_datagram.hpp"
#include "drivers/can/can_link.hpp"

namespace tankrig {
namespace {

constexpr std::string_view kHubPrefix = "unix:";

template <class T>
bool set(int fd, int level, int option, const T& value) noexcept {
  return ::setsockopt(fd, level, option, &value, sizeof value) == 0;
}

ifreq request(const std::string& interface) noexcept {
  ifreq r{};
  interface.copy(r.ifr_name, IFNAMSIZ - 1);
  return r;
}

/// 0 if there is no such interface.
int index_of(int fd, const std::string& interface) noexcept {
  ifreq r = request(interface);
  return ::ioctl(fd, SIOCGIFINDEX, &r) == 0 ? r.ifr_ifindex : 0;
}

bool is_up(int fd, const std::string& interface) noexcept {
  ifreq r = request(interface);
  return ::ioctl(fd, SIOCGIFFLAGS, &r) == 0 && (r.ifr_flags & IFF_UP);
}

/// What waits to be told is of before: the interface has been down, or was when it was bound to.
void forget_error(int fd) noexcept {
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
}

bool is_can(int fd, const std::string& interface) noexcept {
  ifreq r = request(interface);
  return ::ioctl(fd, SIOCGIFHWADDR, &r) == 0 && r.ifr_hwaddr.sa_family == ARPHRD_CAN;
}

[[noreturn]] void refuse_socket(const std::string& interface, int error) {
  if (error == EAFNOSUPPORT || error == EPROTONOSUPPORT || error == ESOCKTNOSUPPORT)
    throw InputError(interface +
                     ": this kernel has no CAN sockets: modprobe can-raw, or use the carrier unix:PATH "
                     "(tests/kernel runs real CAN in a guest)");
  throw InputError(interface + ": no CAN socket: " + std::strerror(error));
}

std::vector<can_filter> kernel_filters(const std::vector<CanFilter>& filters, bool everything) {
  constexpr canid_t kStandardData = CAN_EFF_FLAG | CAN_RTR_FLAG;
  std::vector<can_filter> kernel;
  for (const CanFilter& f : filters)
    kernel.push_back({canid_t{f.id} & CAN_SFF_MASK, (canid_t{f.mask} & CAN_SFF_MASK) | kStandardData});
  if (kernel.empty()) kernel.push_back({0, everything ? 0 : kStandardData});
  return kernel;
}

/// What the kernel charges a local socket's sender for one small datagram, measured on Linux 6.1 and 6.18; it doubles
/// what it is asked for.
constexpr int kBytesPerQueuedFrame = 768 / 2;
/// Of an interface: two exchanges with the arm, a demand that waits and the rest behind it.
constexpr int kQueuedFrames = 10;

}  // namespace

CanCarrier CanCarrier::open(const CanSettings& settings, Role role) {
  const std::string& name = settings.interface;
  if (name.starts_with(kHubPrefix)) return open_hub(name.substr(kHubPrefix.size()), settings, role);
  return open_interface(settings, role);
}

CanCarrier CanCarrier::open_interface(const CanSettings& settings, Role role) {
  const std::string& name = settings.interface;
  if (name.empty() || name.size() >= IFNAMSIZ || name.find('/') != std::string::npos)
    throw InputError(fmt::format("CAN interface: found '{}', expected a name such as can0, or unix:PATH", name));
  CanCarrier carrier(Kind::kInterface, name);
  carrier.role_ = role;
  carrier.fd_ = OwnedDescriptor(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  const int fd = carrier.fd_.get();
  if (fd < 0) refuse_socket(name, errno);
  const int index = index_of(fd, name);
  if (index == 0)
    throw InputError(
        fmt::format("{0} does not exist: plug the adapter in, or for a virtual bus: ip link add {0} type vcan", name));
  if (!is_can(fd, name)) throw InputError(name + " is not a CAN interface: see `ip -details link` for those that are");
  if (!is_up(fd, name))
    throw InputError(
        fmt::format("{0} is down: ip link set {0} up type can bitrate {1} restart-ms 100 (a vcan: ip link set {0} up)",
                    name, settings.bitrate));
  carrier.check_link(settings);
  carrier.filters_ =
      kernel_filters(role == Role::kListener ? std::vector<CanFilter>{} : settings.filters, role == Role::kListener);
  if (role == Role::kListener) set(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1);
  enable_reports(fd);
  // Beyond the system's limit only with CAP_NET_ADMIN.
  if (!set(fd, SOL_SOCKET, SO_RCVBUFFORCE, settings.receive_buffer_bytes))
    set(fd, SOL_SOCKET, SO_RCVBUF, settings.receive_buffer_bytes);
  set(fd, SOL_SOCKET, SO_SNDBUF, kQueuedFrames * kBytesPerQueuedFrame);
  if (const int error = carrier.bind_to(index))
    throw InputError(name + ": cannot bind: " + std::strerror(error) +
                     (error == EPERM || error == EACCES ? ": run as a user who may use CAN sockets" : ""));
  return carrier;
}

void CanCarrier::check_link(const CanSettings& settings) {
  const std::optional<CanLink> link = read_can_link(name_);
  if (!link) return;
  const std::string again = fmt::format(": ip link set {0} down && ip link set {0} up type can ", name_);
  if (settings.check_bitrate && link->bitrate && *link->bitrate != settings.bitrate)
    throw InputError(fmt::format("{0} runs at {1} bit/s, expected {2}{3}bitrate {2}", name_, *link->bitrate,
                                 settings.bitrate, again));
  if (link->listen_only && role_ == Role::kNode)
    throw InputError(name_ + " only listens and cannot send" + again + "listen-only off");
  first_state_ = link->state.value_or(first_state_);
  restarts_ = link->restart_ms.value_or(1) > 0;
}

CanCarrier CanCarrier::open_hub(const std::string& path, const CanSettings& settings, Role role) {
  CanCarrier carrier(Kind::kHub, std::filesystem::path(path).stem().string());
  carrier.role_ = role;
  carrier.hub_.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof carrier.hub_.sun_path)
    throw InputError(fmt::format(
        "CAN interface unix:{}: found a path of {} bytes, expected 1 to {}: choose a shorter runtime folder", path,
        path.size(), sizeof carrier.hub_.sun_path - 1));
  path.copy(carrier.hub_.sun_path, path.size());
  carrier.queue_bytes_ = settings.send_queue_frames * kBytesPerQueuedFrame;
  const int error = carrier.connect();
  if (error == ENOENT || error == ECONNREFUSED)
    throw InputError("unix:" + path + ": no CAN bus " + (error == ENOENT ? "there" : "there any more") +
                     ": start its emulator first (tankrig emulate)");
  if (error == EACCES || error == EPERM)
    throw InputError("unix:" + path + ": no permission: run as the user who started the emulator");
  if (error) throw InputError("unix:" + path + ": cannot connect: " + std::strerror(error));
  return carrier;
}

std::pair<CanCarrier, CanCarrier> CanCarrier::pair() {
  int fds[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, fds) != 0)
    throw std::system_error(errno, std::generic_category(), "CAN pair");
  CanCarrier a(Kind::kPair, "can0"), b(Kind::kPair, "can0");
  a.fd_ = OwnedDescriptor(fds[0]);
  b.fd_ = OwnedDescriptor(fds[1]);
  enable_reports(fds[0]);
  enable_reports(fds[1]);
  return {std::move(a), std::move(b)};
}

/// The kernel forgets a socket's filters when the interface goes, so they are set each time.
int CanCarrier::bind_to(int index) noexcept {
  ::setsockopt(fd_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters_.data(),
               static_cast<socklen_t>(filters_.size() * sizeof filters_[0]));
  set(fd_.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, can_err_mask_t{CAN_ERR_MASK});
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return errno;
  index_ = index;
  return 0;
}

int CanCarrier::connect() noexcept {
  OwnedDescriptor fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fd) return errno;
  enable_reports(fd.get());
  if (queue_bytes_ > 0) set(fd.get(), SOL_SOCKET, SO_SNDBUF, queue_bytes_);
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&hub_), sizeof hub_) != 0) return errno;
  if (role_ == Role::kListener) ::shutdown(fd.get(), SHUT_WR);
  fd_ = std::move(fd);
  return 0;
}

CanCarrier::Presence CanCarrier::look() noexcept {
  switch (kind_) {
    case Kind::kPair:
      return fd_ ? Presence::kUp : Presence::kGone;
    case Kind::kHub:
      return fd_ || connect() == 0 ? Presence::kUp : Presence::kGone;
    case Kind::kInterface:
      break;
  }
  const int index = index_of(fd_.get(), name_);
  if (index == 0) {
    index_ = 0;
    return Presence::kGone;
  }
  if (index != index_ && bind_to(index) != 0) return Presence::kGone;
  forget_error(fd_.get());
  return is_up(fd_.get(), name_) ? Presence::kUp : Presence::kDown;
}

void CanCarrier::lose() noexcept {
  if (kind_ != Kind::kInterface) fd_.reset();
}

}  // namespace tankrig
