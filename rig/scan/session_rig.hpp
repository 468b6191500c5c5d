// The rig in a session: what a scan writes down of it, and the rig file read back.
#pragma once

#include <filesystem>

#include "rig/config/rig_config.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// Cameras, calibration and object as a session keeps them; the mesh by its file name.
void describe(const RigConfig& rig, SessionInfo& info);

/// The rig file of a session, which is all in its own folder.  Errors: InputError, also if it has a `base`.
ConfigNode session_rig_file(const std::filesystem::path& session);

}  // namespace tankrig
