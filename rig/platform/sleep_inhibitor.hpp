// Keeps the machine awake while something may move or shine.
#pragma once

#include <string>
#include <vector>

#include "core/time.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "rig/platform/finding.hpp"

namespace tankrig {

/// While it lives, logind neither suspends nor shuts down this machine on request, nor when its lid is closed. Root may
/// override that; a suspension is then a fault of the cycle (SuspendWatch). Without logind, or if it refuses, nothing
/// is inhibited and missing() says why.
/// Threads: any; GLib has one of its own.
class SleepInhibitor {
 public:
  /// The longest wait for logind.
  static constexpr Duration kPatience = std::chrono::seconds{2};

  /// `bus`: the message bus's address; empty: the system bus.
  explicit SleepInhibitor(const std::string& bus = {}, Duration patience = kPatience);

  /// What may still suspend the machine, and why; empty: nothing.
  const std::string& missing() const noexcept { return missing_; }

 private:
  std::vector<OwnedDescriptor> locks_;  // logind watches them
  std::string missing_;
};

/// Takes the inhibitor and gives it back. Without it the verdict is usable: a scan goes on.
Finding suspend_finding(const std::string& bus = {});

}  // namespace tankrig
