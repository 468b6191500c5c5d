#include "sim_backends/wire/gige_control.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "sim_backends/wire/wire_priority.hpp"

namespace tankrig::sim {
namespace {

using namespace gige_register;

constexpr std::uint16_t kPort = 3956;
constexpr std::uint8_t kKey = 0x42;
constexpr std::size_t kHeader = 8, kDiscoveryData = 0xF8, kLargestRead = 536;
constexpr std::uint16_t kDiscovery = 0x0002, kReadRegister = 0x0080, kWriteRegister = 0x0082, kReadMemory = 0x0084,
                        kWriteMemory = 0x0086;
constexpr std::uint16_t kNotImplemented = 0x8001, kInvalidAddress = 0x8003, kAccessDenied = 0x8006;

std::uint16_t word16(std::span<const std::uint8_t> b) { return static_cast<std::uint16_t>(b[0] << 8 | b[1]); }
std::uint32_t word32(std::span<const std::uint8_t> b) {
  return static_cast<std::uint32_t>(word16(b)) << 16 | word16(b.subspan(2));
}
void put16(std::vector<std::uint8_t>& to, std::uint16_t value) {
  to.push_back(static_cast<std::uint8_t>(value >> 8));
  to.push_back(static_cast<std::uint8_t>(value));
}
void put32(std::vector<std::uint8_t>& to, std::uint32_t value) {
  put16(to, static_cast<std::uint16_t>(value >> 16));
  put16(to, static_cast<std::uint16_t>(value));
}

/// The broadcast address of the interface that has this address (0 where it has none); nothing if no interface has it.
std::optional<in_addr_t> broadcast_of(in_addr_t address) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return std::nullopt;
  std::optional<in_addr_t> found;
  const auto internet = [](const sockaddr* a) { return reinterpret_cast<const sockaddr_in*>(a)->sin_addr.s_addr; };
  for (const ifaddrs* i = all; i && !found; i = i->ifa_next)
    if (i->ifa_addr && i->ifa_addr->sa_family == AF_INET && internet(i->ifa_addr) == address)
      found = (i->ifa_flags & IFF_BROADCAST) && i->ifa_broadaddr ? internet(i->ifa_broadaddr) : 0;
  ::freeifaddrs(all);
  return found;
}

/// -1 if it cannot be had.
int bound_socket(in_addr_t address, bool shared) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  const int yes = 1;
  if (shared) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  ::setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(kPort);
  at.sin_addr.s_addr = address;
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0) return fd;
  ::close(fd);
  return -1;
}

/// Both clocks at one moment: read again where the thread was held up between the two.
std::pair<Stamp, Duration> now_and_wall(const MonotonicClock& clock) {
  constexpr int kTries = 5;
  constexpr Duration kTogether = std::chrono::microseconds(20);
  Stamp before, after;
  timespec wall{};
  for (int i = 0; i < kTries && (i == 0 || after - before > kTogether); ++i) {
    before = clock.now();
    ::clock_gettime(CLOCK_REALTIME, &wall);
    after = clock.now();
  }
  return {before + (after - before) / 2, std::chrono::seconds(wall.tv_sec) + Duration(wall.tv_nsec)};
}

/// When the kernel took the datagram, on our clock: it stamps in system time, and what counts is the stamp's age.
Stamp arrival_of(msghdr& message, const MonotonicClock& clock) {
  const auto [now, wall] = now_and_wall(clock);
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec taken{};
    std::memcpy(&taken, CMSG_DATA(c), sizeof taken);
    const Duration age = wall - std::chrono::seconds(taken.tv_sec) - Duration(taken.tv_nsec);
    return now - std::clamp<Duration>(age, Duration{0}, std::chrono::seconds(1));
  }
  return now;
}

}  // namespace

GigeControl::GigeControl(const std::string& address, GigeRegisters& registers, Written written)
    : registers_(registers), written_(std::move(written)) {
  if (open(address)) thread_ = std::thread([this] { run(); });
}

GigeControl::~GigeControl() {
  if (thread_.joinable()) {
    ::eventfd_write(ending_, 1);
    thread_.join();
  }
  for (const int fd : sockets_) ::close(fd);
  if (ending_ >= 0) ::close(ending_);
}

bool GigeControl::open(const std::string& address) {
  in_addr at{};
  if (::inet_pton(AF_INET, address.c_str(), &at) != 1) return false;
  const std::optional<in_addr_t> broadcast = broadcast_of(at.s_addr);
  if (!broadcast) return false;
  const auto take = [this](int fd) {
    if (fd >= 0) sockets_.push_back(fd);
    return fd >= 0;
  };
  if (!take(bound_socket(at.s_addr, false))) return false;
  take(bound_socket(INADDR_BROADCAST, true));
  if (*broadcast != 0) take(bound_socket(*broadcast, true));
  ending_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  registers_.set(kAddress, ntohl(at.s_addr));
  return ending_ >= 0;
}

void GigeControl::run() {
  set_fifo("gige-control", kEmulatedWirePriority);
  std::vector<pollfd> events;
  for (const int fd : sockets_) events.push_back({fd, POLLIN, 0});
  events.push_back({ending_, POLLIN, 0});
  while (true) {
    const int ready = ::poll(events.data(), events.size(), until_silence());
    if (ready < 0) continue;
    if (ready == 0) drop_silent_controller(clock_.now());
    if (events.back().revents != 0) return;
    for (const pollfd& e : events)
      if (e.revents != 0) receive(e.fd);
  }
}

void GigeControl::receive(int fd) {
  std::array<std::uint8_t, 2048> packet;
  std::array<std::uint8_t, 128> extra;
  sockaddr_in from{};
  iovec into{packet.data(), packet.size()};
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof from;
  message.msg_iov = &into;
  message.msg_iovlen = 1;
  message.msg_control = extra.data();
  message.msg_controllen = extra.size();
  const ssize_t size = ::recvmsg(fd, &message, 0);
  if (size <= 0) return;
  const Bytes reply = answer({packet.data(), static_cast<std::size_t>(size)}, {from.sin_addr.s_addr, from.sin_port},
                             arrival_of(message, clock_));
  if (!reply.empty())
    ::sendto(fd, reply.data(), reply.size(), 0, reinterpret_cast<const sockaddr*>(&from), sizeof from);
}

GigeControl::Bytes GigeControl::answer(std::span<const std::uint8_t> packet, const Peer& peer, Stamp arrival) {
  if (packet.size() < kHeader || packet[0] != kKey || packet.size() < kHeader + word16(packet.subspan(4))) return {};
  const std::uint16_t command = word16(packet.subspan(2)), id = word16(packet.subspan(6));
  const bool writes = command == kWriteRegister || command == kWriteMemory;
  if (writes && last_write_.id == id && last_write_.peer == peer) return last_write_.answer;

  drop_silent_controller(arrival);
  std::uint16_t status = 0;
  const Bytes data = carry_out(command, packet.subspan(kHeader, word16(packet.subspan(4))), arrival,
                               !controller_ || *controller_ == peer, status);
  update_controller(peer, arrival);
  if (status == kNotImplemented) return {};
  Bytes reply;
  put16(reply, status);
  put16(reply, command + 1);
  put16(reply, static_cast<std::uint16_t>(data.size()));
  put16(reply, id);
  reply.insert(reply.end(), data.begin(), data.end());
  if (writes) last_write_ = {peer, id, reply};
  return reply;
}

GigeControl::Bytes GigeControl::carry_out(std::uint16_t command, std::span<const std::uint8_t> arguments, Stamp arrival,
                                          bool may_write, std::uint16_t& status) {
  Bytes data;
  const auto fail = [&](std::uint16_t why) {
    status = why;
    return Bytes{};
  };
  switch (command) {
    case kDiscovery:
      data.resize(kDiscoveryData);
      registers_.read(0, data);
      return data;
    case kReadRegister:
      for (; arguments.size() >= 4; arguments = arguments.subspan(4)) put32(data, registers_.get(word32(arguments)));
      return data;
    case kReadMemory: {
      if (arguments.size() < 8) return fail(kInvalidAddress);
      const std::size_t count = word16(arguments.subspan(6));
      if (count > kLargestRead) return fail(kInvalidAddress);
      data.resize(4 + count);
      std::copy_n(arguments.begin(), 4, data.begin());
      if (!registers_.read(word32(arguments), std::span(data).subspan(4))) return fail(kInvalidAddress);
      return data;
    }
    case kWriteRegister: {
      if (!may_write) return fail(kAccessDenied);
      std::uint32_t written = 0;
      for (; arguments.size() >= 8; arguments = arguments.subspan(8), ++written)
        write_register(word32(arguments), word32(arguments.subspan(4)), arrival);
      put32(data, written);
      return data;
    }
    case kWriteMemory: {
      if (!may_write) return fail(kAccessDenied);
      if (arguments.size() < 8) return fail(kInvalidAddress);
      const std::uint32_t address = word32(arguments);
      arguments = arguments.subspan(4);
      if (!registers_.write(address, arguments)) return fail(kInvalidAddress);
      for (std::uint32_t at = 0; at + 4 <= arguments.size(); at += 4)
        written_(address + at, word32(arguments.subspan(at)), arrival);
      put32(data, static_cast<std::uint32_t>(arguments.size()));
      return data;
    }
    default:
      return fail(kNotImplemented);
  }
}

void GigeControl::write_register(std::uint32_t address, std::uint32_t value, Stamp arrival) {
  registers_.set(address, value);
  written_(address, value, arrival);
}

/// In ms, as poll() wants it: until the controller has been silent for too long; for ever where there is none.
int GigeControl::until_silence() const {
  if (!controller_) return -1;
  const Duration left = heard_ + std::chrono::milliseconds(registers_.get(kHeartbeatMs)) - clock_.now();
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(left).count() + 1;
  return static_cast<int>(std::clamp<std::int64_t>(ms, 0, std::numeric_limits<int>::max()));
}

void GigeControl::drop_silent_controller(Stamp now) {
  if (!controller_ || now - heard_ <= std::chrono::milliseconds(registers_.get(kHeartbeatMs))) return;
  controller_.reset();
  write_register(kControlPrivilege, 0, now);
}

void GigeControl::update_controller(const Peer& peer, Stamp arrival) {
  const bool controlled = registers_.get(kControlPrivilege) != 0;
  if (!controlled) controller_.reset();
  if (controlled && !controller_) controller_ = peer;
  if (controller_ == peer) heard_ = arrival;
}

}  // namespace tankrig::sim
