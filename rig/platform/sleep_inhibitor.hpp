// Keeps the machine from being suspended while something may move or shine.
#pragma once

#include <string>
#include <vector>

#include "core/time.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "rig/platform/finding.hpp"

namespace tankrig {

/// While it lives, logind suspends this machine neither when somebody asks for it nor when its lid is closed. (Root may
/// override that; a suspension that comes all the same is a fault of the cycle: SuspendWatch.) Where there is no
/// logind, or it refuses, nothing is kept off and missing() says why.
/// Threads: any; GLib has one of its own.
class SleepInhibitor {
 public:
  /// The longest it waits for logind.
  static constexpr Duration kPatience = std::chrono::seconds{2};

  /// `bus`: the message bus's address; empty: the system's.
  explicit SleepInhibitor(const std::string& bus = {}, Duration patience = kPatience);

  /// What may still suspend the machine, and why; empty: nothing.
  const std::string& missing() const noexcept { return missing_; }

 private:
  std::vector<OwnedDescriptor> locks_;  // logind watches them
  std::string missing_;
};

/// Takes the inhibitor, and gives it back. Usable without: a scan goes on.
Finding suspend_finding(const std::string& bus = {});

}  // namespace tankrig
