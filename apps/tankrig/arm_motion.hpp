// One checked motion of the arm, laser off: from the posture read to the posture asked for.
#pragma once

#include <functional>
#include <string>

#include "apps/tankrig/arm_commands.hpp"
#include "apps/tankrig/backend.hpp"
#include "apps/tankrig/progress.hpp"

namespace tankrig::app {

/// Commands the laser off and waits until it reads back dark.
/// Errors: InputError if that is not confirmed within the rig's rest timeout.
void make_laser_dark(Backend& backend, const ScanSettings& settings);

/// Where the arm is.  Errors: InputError that says what to do, if the arm is silent or does not know its joints yet.
JointVector homed_posture(Backend& backend, const std::string& rig);

/// The arm may move from here on. A program that does not come to end_motion() leaves no proof of the arm's zero.
/// Errors: InputError, where another program moves it.
void begin_motion(Backend& backend);
/// Nothing moves any more: what proves the zero to the next program is kept, or why it is not is told.
void end_motion(Backend& backend, Progress& progress);

/// Encoders say the same for a while, within `timeout`. Works without angles too. A stop that is not taken is told.
bool came_to_rest(Arm& arm, Clock& clock, Duration timeout, Progress& progress);

struct ArmTarget {
  std::string name;  ///< of the motion, for progress and messages: "move elbow"
  JointVector q = JointVector::Zero();
  double velocity = 0;  ///< of the fastest joint [rad/s]
};

/// Where to, from where the arm is.
using TargetFrom = std::function<ArmTarget(const RigConfig& rig, const JointVector& now)>;

/// Checks the motion against limits, speeds and obstacles, moves, and prints where the arm came to rest.
/// Returns kOk; kPartial if it was stopped by a signal; kFailure after a fault, or if rest or darkness is not
/// confirmed. Errors: InputError before anything moves.
int move_arm(const ArmCommandOptions& options, const TargetFrom& target_from);

}  // namespace tankrig::app
