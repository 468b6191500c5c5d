// The rig as a session describes it.
#pragma once

#include "rig/config/rig_config.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// Cameras, calibration and object as a session keeps them; the mesh by its file name. Poses are as they will be read
/// back: a calibration is proved by its text, and a pose read and written again is not the same text.
void describe(const RigConfig& rig, SessionInfo& info);

}  // namespace tankrig
