// The rig file's `scan: real_time:`: what the cycle asks of the system.
#pragma once

#include <string>

#include "core/config_node.hpp"
#include "rig/platform/real_time_settings.hpp"

namespace tankrig {

/// Takes from `scan: real_time:` what it has; what it lacks keeps its value.
/// Errors: InputError with file and line.
void read_real_time_section(const ConfigNode& scan, RealTimeSettings& settings);

/// The section's lines, indented by two blanks.
std::string real_time_section_yaml(const RealTimeSettings& settings);

}  // namespace tankrig
