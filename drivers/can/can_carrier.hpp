// Carries the frames: a kernel interface, the hub of a cross-process bus, or the other end of a pair.
#pragma once

#include <linux/can.h>
#include <sys/un.h>

#include <string>
#include <utility>
#include <vector>

#include "drivers/can/open_can.hpp"
#include "drivers/can/owned_descriptor.hpp"

namespace tankrig {

/// A descriptor that sends and receives `struct can_frame`, and the way to restore it.
/// Threads: one; send_regardless() any.
class CanCarrier {
 public:
  enum class Presence : std::uint8_t { kUp, kDown, kGone };
  /// A listener sends nothing and hears everything, also remote frames, 29-bit identifiers and CAN FD.
  enum class Role : std::uint8_t { kNode, kListener };

  /// Errors: InputError, see open_can().
  static CanCarrier open(const CanSettings& settings, Role role = Role::kNode);
  /// Errors: std::system_error.
  static std::pair<CanCarrier, CanCarrier> pair();

  /// -1 while a hub or the other end of a pair is gone; an interface keeps its descriptor.
  int descriptor() const noexcept { return fd_.get(); }
  /// Its name in a log: the interface, or the socket's file name without extension.
  const std::string& name() const noexcept { return name_; }

  /// Whether it is there; binds or connects again if needed. Never waits for the other side. Binding to an interface
  /// that has come back takes the kernel's network configuration lock, for as long as an `ip link` holds it.
  Presence look() noexcept;
  /// The other side has closed, or no longer answers.
  void lose() noexcept;
  /// The controller's value when it was opened.
  CanState first_state() const noexcept { return first_state_; }
  /// Leaves bus-off by itself (restart-ms), as far as the kernel said.
  bool restarts() const noexcept { return restarts_; }

 private:
  enum class Kind : std::uint8_t { kInterface, kHub, kPair };
  CanCarrier(Kind kind, std::string name) : kind_(kind), name_(std::move(name)) {}
  static CanCarrier open_interface(const CanSettings& settings, Role role);
  static CanCarrier open_hub(const std::string& path, const CanSettings& settings, Role role);
  void check_link(const CanSettings& settings);
  int bind_to(int index) noexcept;
  int connect() noexcept;

  Kind kind_;
  Role role_ = Role::kNode;
  OwnedDescriptor fd_;
  std::string name_;
  CanState first_state_ = CanState::kErrorActive;
  bool restarts_ = true;
  int index_ = 0;                    ///< of the interface bound to
  std::vector<can_filter> filters_;  ///< of an interface
  sockaddr_un hub_{};                ///< of a hub
  int queue_bytes_ = 0;              ///< of a hub's sender
};

}  // namespace tankrig
