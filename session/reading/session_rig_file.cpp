#include "session/reading/session_rig_file.hpp"

#include "core/regular_file.hpp"
#include "session/reading/session_folder.hpp"

namespace tankrig {

ConfigNode session_rig_file(const std::filesystem::path& session) {
  const ConfigNode root =
      ConfigNode::parse(read_below(session, "rig.yaml", kMostYamlBytes, "a YAML file"), session / "rig.yaml");
  if (root.has("base")) root.fail("base", "found a base, expected the rig file of a session, which stands alone");
  return root;
}

}  // namespace tankrig
