#include "rig/scan/session_rig.hpp"

namespace tankrig {

void describe(const RigConfig& rig, SessionInfo& info) {
  info.rig = rig.name;
  info.cameras.clear();
  for (const RigCamera& camera : rig.cameras)
    info.cameras.push_back({camera.name, camera.role, camera.model, camera.bMc, camera.time_offset});
  info.calibration = {rig.arm, rig.laser.ePl, rig.laser.origin_e, rig.laser.direction_e, rig.laser.fan};
  info.object = SessionObject{rig.object.mesh.filename().string(), rig.object.bMo};
}

}  // namespace tankrig
