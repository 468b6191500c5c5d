#include "rig/scan/session_rig.hpp"

namespace tankrig {

void describe(const RigConfig& rig, SessionInfo& info) {
  info.rig = rig.name;
  info.cameras.assign(rig.cameras.begin(), rig.cameras.end());
  info.calibration = {rig.arm, rig.laser.ePl, rig.laser.origin_e, rig.laser.direction_e, rig.laser.fan};
  for (CalibratedCamera& camera : info.cameras) camera.bMc = as_stored(camera.bMc);
  info.object = SessionObject{rig.object.mesh.filename().string(), as_stored(rig.object.bMo)};
}

}  // namespace tankrig
