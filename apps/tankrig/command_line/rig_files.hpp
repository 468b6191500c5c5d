// Where rigs are found: a path, a name below etc/rigs of the source tree, or one installed with the program.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tankrig::app {

/// Names of the rigs that are found without a path.
std::vector<std::string> known_rigs();

/// The rig.yaml that `name_or_path` means.
/// Errors: InputError listing the rigs that exist.
std::filesystem::path find_rig(const std::string& name_or_path);

}  // namespace tankrig::app
