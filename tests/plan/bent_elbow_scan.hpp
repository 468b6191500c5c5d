// A scan in a corner of the arm's room.
#pragma once

#include "rig/plan/scan_settings.hpp"

namespace tankrig {

/// Parked beside the sweep's begin, the elbow bent.
inline ScanSettings bent_elbow_scan() {
  ScanSettings s;
  s.park << 0, 0.3, 0.6, 0, 0.1;
  s.posture << 0, 0.12, 0, 0, 0.1;
  return s;
}

}  // namespace tankrig
