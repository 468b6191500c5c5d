// The rig file's `scan` section, and its presets, which are parts of one.
#pragma once

#include "core/settings_table.hpp"
#include "rig/plan/scan_settings.hpp"

namespace tankrig {

extern const SettingsTable<ScanSettings> kScanKeys;

/// Postures within the arm's limits and what the settings demand of each other; complaints point into `node`.
void check_scan_section(const ConfigNode& node, const ScanSettings& scan, const ArmModel& arm);

}  // namespace tankrig
