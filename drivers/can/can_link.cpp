#include "drivers/can/can_link.hpp"

#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>

#include <cstring>
#include <span>

#include "drivers/can/owned_descriptor.hpp"

namespace tankrig {
namespace {

template <class T>
std::optional<T> value_of(const rtattr* a) {
  if (RTA_PAYLOAD(a) < sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, RTA_DATA(a), sizeof value);
  return value;
}

/// Calls `visit` for each attribute from `a` on.
template <class Visit>
void for_each(const rtattr* a, int bytes, Visit visit) {
  for (; RTA_OK(a, bytes); a = RTA_NEXT(a, bytes)) visit(a->rta_type & NLA_TYPE_MASK, a);
}

template <class Visit>
void for_each_within(const rtattr* a, Visit visit) {
  for_each(static_cast<const rtattr*>(RTA_DATA(a)), static_cast<int>(RTA_PAYLOAD(a)), visit);
}

CanState state_of(std::uint32_t kernel) {
  switch (kernel) {
    case CAN_STATE_ERROR_ACTIVE:
      return CanState::kErrorActive;
    case CAN_STATE_ERROR_WARNING:
      return CanState::kErrorWarning;
    case CAN_STATE_ERROR_PASSIVE:
      return CanState::kErrorPassive;
    case CAN_STATE_BUS_OFF:
      return CanState::kBusOff;
    default:
      return CanState::kDown;
  }
}

void take(CanLink& link, int type, const rtattr* a) {
  switch (type) {
    case IFLA_CAN_BITTIMING:
      if (const auto timing = value_of<can_bittiming>(a); timing && timing->bitrate > 0)
        link.bitrate = static_cast<int>(timing->bitrate);
      break;
    case IFLA_CAN_STATE:
      if (const auto state = value_of<std::uint32_t>(a)) link.state = state_of(*state);
      break;
    case IFLA_CAN_RESTART_MS:
      if (const auto ms = value_of<std::uint32_t>(a)) link.restart_ms = static_cast<int>(*ms);
      break;
    case IFLA_CAN_CTRLMODE:
      if (const auto mode = value_of<can_ctrlmode>(a)) link.listen_only = mode->flags & CAN_CTRLMODE_LISTENONLY;
      break;
    default:
      break;
  }
}

/// The kernel's answer about one interface; empty on any failure.
std::span<char> ask(unsigned index, std::span<char> buffer) {
  const OwnedDescriptor fd(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  const timeval limit{1, 0};
  ::setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  struct {
    nlmsghdr header;
    ifinfomsg body;
  } request{};
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.body.ifi_index = static_cast<int>(index);
  if (::send(fd.get(), &request, sizeof request, 0) < 0) return {};
  const ssize_t bytes = ::recv(fd.get(), buffer.data(), buffer.size(), 0);
  return bytes > 0 ? buffer.first(static_cast<std::size_t>(bytes)) : std::span<char>{};
}

}  // namespace

std::optional<CanLink> read_can_link(const std::string& interface) {
  const unsigned index = ::if_nametoindex(interface.c_str());
  if (index == 0) return std::nullopt;
  alignas(nlmsghdr) char buffer[32 << 10];
  const auto answer = ask(index, buffer);
  const auto* header = reinterpret_cast<const nlmsghdr*>(answer.data());
  if (!NLMSG_OK(header, answer.size()) || header->nlmsg_type != RTM_NEWLINK) return std::nullopt;

  std::optional<CanLink> link;
  const auto* body = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  for_each(IFLA_RTA(body), static_cast<int>(IFLA_PAYLOAD(header)), [&](int type, const rtattr* a) {
    if (type != IFLA_LINKINFO) return;
    link.emplace();
    const rtattr* details = nullptr;
    for_each_within(a, [&](int inner, const rtattr* b) {
      if (inner == IFLA_INFO_KIND)
        link->kind.assign(static_cast<const char*>(RTA_DATA(b)),
                          ::strnlen(static_cast<const char*>(RTA_DATA(b)), RTA_PAYLOAD(b)));
      if (inner == IFLA_INFO_DATA) details = b;
    });
    if (details && link->kind == "can")
      for_each_within(details, [&](int inner, const rtattr* b) { take(*link, inner, b); });
  });
  return link;
}

}  // namespace tankrig
