// The rig file's `scan` section, and its presets, which are parts of one.
#pragma once

#include <string>

#include "core/config_node.hpp"
#include "rig/plan/scan_settings.hpp"

namespace tankrig {

/// Takes from `node` what it has; what it lacks keeps its value. With `complete`, postures and sweep must be there.
/// Errors: InputError with file and line.
void read_scan_section(const ConfigNode& node, bool complete, ScanSettings& scan, bool& read_lux);

/// Postures within the arm's limits and what the settings demand of each other; complaints point into `node`.
void check_scan_section(const ConfigNode& node, const ScanSettings& scan, const ArmModel& arm);

/// The section's lines, without its name.
std::string scan_section_yaml(const ScanSettings& scan, bool read_lux);

/// Every key with its default, range and meaning, as a Markdown table: docs/reference/scan_keys.md.
std::string scan_section_table();

}  // namespace tankrig
