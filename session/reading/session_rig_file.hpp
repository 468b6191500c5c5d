// The rig file in a session.
#pragma once

#include <filesystem>

#include "core/config_node.hpp"

namespace tankrig {

/// rig.yaml as the scan used it, without files from outside the session.
/// Errors: InputError, also if it has a `base`.
ConfigNode session_rig_file(const std::filesystem::path& session);

}  // namespace tankrig
