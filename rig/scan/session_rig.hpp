// The rig as a session describes it.
#pragma once

#include "rig/config/rig_config.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// Cameras, calibration and object as a session keeps them; the mesh by its file name.
void describe(const RigConfig& rig, SessionInfo& info);

/// The same of a rig that is about to record: its poses as the session's rig.yaml will read back. `session recover` proves
/// a calibration by its text, and a pose read and written again is not the same text.
void describe_for_recording(const RigConfig& rig, SessionInfo& info);

}  // namespace tankrig
