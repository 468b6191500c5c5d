// The rig file's `scan: safety:` section.
#pragma once

#include <string>

#include "core/config_node.hpp"
#include "rig/safety/safety_settings.hpp"

namespace tankrig {

/// Takes from `node` what it has; what it lacks keeps its value.
/// Errors: InputError with file and line.
void read_safety_section(const ConfigNode& node, SafetySettings& settings);

/// The section's lines, its name indented by two blanks.
std::string safety_section_yaml(const SafetySettings& settings);

}  // namespace tankrig
