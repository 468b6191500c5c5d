// The rig file's `cameras`: where they stand, when they record and expose, what their stamps mean.
#pragma once

#include "core/settings_table.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig {

extern const SettingsTable<RigCamera> kRigCameraKeys;

/// Names and roles stand once, one camera records the sweep, and a stereo pair has two eyes.
/// Errors: InputError with file and line.
void check_cameras(const ConfigNode& root, const RigConfig& rig);

/// What the scan takes from cameras and object: the time between the sweep's frames, and where residuals are told.
/// Errors: InputError where a camera's trigger and the scan contradict each other.
void settle_camera_timing(RigConfig& rig);

}  // namespace tankrig
