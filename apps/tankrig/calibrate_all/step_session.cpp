#include "apps/tankrig/calibrate_all/step_session.hpp"

#include "apps/tankrig/scan/plan_check.hpp"

namespace tankrig::app {

ReadyRig::PlanFrom there_and_back(RigConfig& rig) {
  rig.scan.sweep.passes = 2;
  rig.scan.sweep.there_and_back = true;
  return [&rig](const JointVector& q) { return sweep_plan(rig, q); };
}

}  // namespace tankrig::app
