// The arm's wire in the format of `candump -L`: as logged, or reconstructed from the joints.
#pragma once

#include <string>
#include <vector>

#include "drivers/arm/arm.hpp"
#include "drivers/arm/can_arm_link.hpp"
#include "session/export/wall_clock.hpp"

namespace tankrig {

/// Interface name of reconstructed lines.
inline constexpr char kSynthesised[] = "synth0";

/// What an arm on CAN would have answered at every joint sample: the master's bytes, then five sensor slots, back to
/// back at `bitrate` from the sample's stamp on. They contain encoder positions modulo 65536 (tick 0 as raw 0) and the
/// current; all else is zero.
/// Units: stamps in whole microseconds, as candump's.
std::string synthesised_candump(const std::vector<JointState>& joints, const ArmCanIds& ids, int bitrate,
                                const WallClock& clock);

}  // namespace tankrig
