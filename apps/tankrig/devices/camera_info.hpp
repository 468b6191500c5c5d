// What a rig file says of a camera's pictures, whatever its driver.
#pragma once

#include "core/settings_table.hpp"
#include "drivers/camera/camera.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

/// What every camera of the rig file's `devices` has, whatever its driver.
extern const SettingsTable<CameraInfo> kDeviceCameraKeys;

/// As its driver delivers it.
CameraInfo camera_info(const RigConfig& rig, const RigCamera& camera);

}  // namespace tankrig::app
