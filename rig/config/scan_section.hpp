// The rig file's `scan` section, and its presets, which are parts of it.
#pragma once

#include "core/settings_table.hpp"
#include "rig/plan/scan_settings.hpp"

namespace tankrig {

extern const SettingsTable<ScanSettings> kScanKeys;

/// Checks that postures are within the arm's limits, and the settings against each other; messages point into `node`.
void check_scan_section(const ConfigNode& node, const ScanSettings& scan, const ArmModel& arm);

}  // namespace tankrig
