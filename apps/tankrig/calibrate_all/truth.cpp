#include "apps/tankrig/calibrate_all/truth.hpp"

#include <cmath>

#include "apps/tankrig/calibrate/measuring_rig.hpp"
#include "apps/tankrig/devices/scene_check.hpp"

namespace tankrig::app {
namespace {

/// The rig file with everything as the tank truly is.
RigConfig true_rig(RigConfig rig, const sim::TankWorld& tank) {
  const Transform bMw = tank.wMb().inverse();
  for (RigCamera& camera : rig.cameras) {
    const sim::CameraSpec& truth = scene_camera(rig, camera, tank);
    camera.model = truth.model;
    camera.bMc = bMw * truth.wMc;
  }
  rig.arm = tank.arm();
  rig.laser.ePl = tank.eMl() * Plane{Vector3d::UnitX(), 0};
  rig.object.bMo = bMw * tank.wMo();
  return rig;
}

}  // namespace

TruthComparison compare_with_truth(const RigConfig& rig, const Transform& bMo_clicked, const sim::TankWorld& tank) {
  const RigConfig truth = true_rig(rig, tank);
  const MeasuringRig measuring = measuring_rig(truth), believed = measuring_rig(rig);
  const std::vector<BudgetTarget> targets = budget_targets(truth.object);
  const auto seen = [&](const Transform& bMbelieved) {
    return misplacement(measuring, believed, bMbelieved, sweep_of(rig), targets);
  };
  const Transform by_mono = measuring.mono.bMc * believed.mono.bMc.inverse();
  const auto object_at = [&](const Transform& bMo) {
    const Transform by_object = truth.object.bMo * bMo.inverse(), off = by_mono * by_object.inverse();
    ObjectComparison out{seen(by_object)};
    for (const BudgetTarget& target : targets)
      out.off += std::pow(target.normal.dot(off * target.p - target.p), 2) / static_cast<double>(targets.size());
    out.off = std::sqrt(out.off);
    return out;
  };
  return {seen(by_mono), object_at(rig.object.bMo), object_at(bMo_clicked)};
}

}  // namespace tankrig::app
