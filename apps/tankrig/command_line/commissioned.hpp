// A start on devices needs a start-up test of the day, or somebody's word that it does not.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "rig/config/rig_config.hpp"

namespace tankrig::app {

inline constexpr const char* kCommission = "commission";

inline void add_waive_option(CLI::App* command, std::vector<std::string>& waived) {
  command->add_option("--waive", waived, "With devices: start without a start-up test (tankrig doctor --commission)")
      ->allow_extra_args(false)
      ->check(CLI::IsMember({kCommission}));
}

/// Its devices are real.
bool hurts(const RigConfig& rig);

/// Who made it and when, and what was waived, for the session; empty where the rig asks for none.
/// Errors: InputError if there is no passed one that is young enough.
std::string require_commission(const RigConfig& rig, const std::vector<std::string>& waived);

}  // namespace tankrig::app
