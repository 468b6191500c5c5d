// An interface's CAN settings, as in `ip -details link show can0`.
#pragma once

#include <optional>
#include <string>

#include "drivers/can/can_bus.hpp"

namespace tankrig {

/// Fields that a virtual interface lacks stay empty.
struct CanLink {
  std::string kind;               ///< "can" (a controller), "vcan", ...
  std::optional<int> bitrate;     ///< [bit/s]
  std::optional<int> restart_ms;  ///< 0: a bus-off lasts until somebody restarts it by hand
  std::optional<CanState> state;
  bool listen_only = false;  ///< acknowledges nothing and cannot send
};

/// Asks the kernel (rtnetlink, linux/can/netlink.h). Nothing if there is no such interface or it does not say.
/// RT: never.
std::optional<CanLink> read_can_link(const std::string& interface);

}  // namespace tankrig
