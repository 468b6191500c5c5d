#include "rig/scan/session_rig.hpp"

namespace tankrig {

void describe(const RigConfig& rig, SessionInfo& info) {
  info.rig = rig.name;
  info.cameras.assign(rig.cameras.begin(), rig.cameras.end());
  info.calibration = {rig.arm, rig.laser.ePl, rig.laser.origin_e, rig.laser.direction_e, rig.laser.fan};
  info.object = SessionObject{rig.object.mesh.filename().string(), rig.object.bMo};
}

void describe_for_recording(const RigConfig& rig, SessionInfo& info) {
  describe(rig, info);
  for (CalibratedCamera& camera : info.cameras) camera.bMc = as_stored(camera.bMc);
  info.object->bMo = as_stored(info.object->bMo);
}

}  // namespace tankrig
