#include "rig/scan/session_rig.hpp"

#include "core/regular_file.hpp"
#include "session/reading/session_folder.hpp"

namespace tankrig {

void describe(const RigConfig& rig, SessionInfo& info) {
  info.rig = rig.name;
  info.cameras.clear();
  for (const RigCamera& camera : rig.cameras)
    info.cameras.push_back({camera.name, camera.role, camera.model, camera.bMc, camera.time_offset});
  info.calibration = {rig.arm, rig.laser.ePl, rig.laser.origin_e, rig.laser.direction_e, rig.laser.fan};
  info.object = SessionObject{rig.object.mesh.filename().string(), rig.object.bMo};
}

ConfigNode session_rig_file(const std::filesystem::path& session) {
  const ConfigNode root =
      ConfigNode::parse(read_below(session, "rig.yaml", kMostYamlBytes, "a YAML file"), session / "rig.yaml");
  if (root.has("base")) root.fail("base", "found a base, expected the rig file of a session, which stands alone");
  return root;
}

}  // namespace tankrig
