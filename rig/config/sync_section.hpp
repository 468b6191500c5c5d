// The rig file's `scan: sync:` section.
#pragma once

#include <string>

#include "core/config_node.hpp"
#include "rig/sync/sync_gate.hpp"

namespace tankrig {

/// Takes from `sync` below `node` what it has; what it lacks keeps its value.
/// Errors: InputError with file and line.
void read_sync_section(const ConfigNode& node, SyncGate& gate);

/// The section's lines, its name indented by two blanks.
std::string sync_section_yaml(const SyncGate& gate);

}  // namespace tankrig
