// How well a frame's joints must be known: the rig file's `scan: sync:` section.
#pragma once

namespace tankrig {

/// A frame beyond either limit is refused.  Units: SI. The defaults are far above what a rig reaches whose arm answers.
struct SyncGate {
  double max_residual = 0.025;            ///< time to the nearer joint sample [s]
  double max_residual_on_target = 0.005;  ///< what the laser plane moves by at the object in that time [m]
};

}  // namespace tankrig
