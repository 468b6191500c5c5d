// When a camera exposes and what its stamps mean: keys of a camera in the rig file.
#pragma once

#include <string>

#include "rig/config/rig_config.hpp"

namespace tankrig {

/// trigger (free | software | position), spacing_rad, trigger_delay_ms, time_offset_s; all optional.
/// Errors: InputError with file and line.
void read_camera_timing(const ConfigNode& node, RigCamera& camera);

/// The keys that are not at their defaults, indented by four blanks.
std::string camera_timing_yaml(const RigCamera& camera);

/// What the scan takes from cameras and object: the time between the sweep's frames, and where residuals are told.
/// Errors: InputError where a camera's trigger and the scan contradict each other.
void settle_camera_timing(RigConfig& rig);

}  // namespace tankrig
