// Postures in which the fixed camera sees the marker in the gripper, and which tell hand-eye calibration what it needs.
#pragma once

#include <vector>

#include "apps/tankrig/calibrate/targets.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

/// Fewer are not enough.
inline constexpr std::size_t kLeastPostures = 12;

/// At most `targets.postures`, far apart in slew, shoulder, elbow and jaw rotation, in an order that can be driven from
/// `from` and back: each move keeps limits and clearance, with the marker's plate in the gripper. Seen is what the rig
/// file's geometry says; the true one may differ by centimetres, so the marker stays away from the image's edge.
/// Errors: InputError if fewer than kLeastPostures are left, with what stands in the way.
std::vector<JointVector> marker_postures(const RigConfig& rig, const GripperTarget& target, const JointVector& from,
                                         Progress& progress);

}  // namespace tankrig::app
