// What the emulated devices do by themselves when the process that commands them is killed.
#pragma once

#include <optional>
#include <string>

#include "core/time.hpp"

namespace tankrig::scenarios {

struct Killed {
  bool in_sweep = false;  ///< laser on and arm moving when it was killed; else nothing was measured
  Stamp when{};
  std::optional<Stamp> opened, rested;
  Duration machine_late{};  ///< MachineWitness, all the while
};

/// Scans over `carrier` in a process of its own and kills it in its sweep.
Killed kill_scan(const std::string& carrier);

/// As verdict.hpp's.
bool too_late(const Killed& killed);
std::string broken(const Killed& killed);

}  // namespace tankrig::scenarios
