// How `calibrate all` sweeps.
#pragma once

#include "apps/tankrig/scan/ready_rig.hpp"

namespace tankrig::app {

/// A sweep over the rig's whole range and back, lit both ways. `rig` must outlive it.
ReadyRig::PlanFrom there_and_back(RigConfig& rig);

}  // namespace tankrig::app
