// The rig file's `cameras`: where they stand, when they record and expose, what their stamps mean.
#pragma once

#include "core/settings_table.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig {

extern const SettingsTable<RigCamera> kRigCameraKeys;

/// Names and roles are unique, one camera records the sweep, and a stereo pair has two cameras.
/// Errors: InputError with file and line.
void check_cameras(const ConfigNode& root, const RigConfig& rig);

/// Fills in what the scan takes from cameras and object: the time between the sweep's frames, and the target of
/// residuals.
/// Errors: InputError if a camera's trigger and the scan contradict each other.
void settle_camera_timing(RigConfig& rig);

}  // namespace tankrig
