// One checked motion of the arm, laser off: from the posture read to the posture asked for.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "apps/tankrig/arm/arm_commands.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "rig/executive/safe_end.hpp"
#include "rig/scan/scan.hpp"

namespace tankrig::app {

/// Commands the laser off and waits until it reads back dark.
/// Errors: InputError if that is not confirmed within the rig's rest timeout.
void make_laser_dark(Backend& backend, const ScanSettings& settings);

/// Commands rest by `rest`, which says whether it was taken, until the encoders say the same for a while; false after
/// `timeout`. `tell`: whether the arm rests, whenever there is reason to say.
bool came_to_rest(Backend& backend, Duration timeout, const std::function<bool()>& rest,
                  const std::function<void(bool)>& tell);

/// Where the arm is.
/// Errors: InputError that says what to do, if the arm is silent or does not know its joints yet.
JointVector homed_posture(Backend& backend, const std::string& rig);

/// While it lives, the arm may move. However it ends, the arm is looked at once more, and what proves its zero to the
/// next program is kept, or why it is not is told. A program that dies meanwhile leaves no proof.
class Motion {
 public:
  /// Errors: InputError, where another program moves the arm.
  Motion(Backend& backend, const SafetySettings& safety, Progress& progress);
  ~Motion() { end(); }
  Motion(const Motion&) = delete;
  Motion& operator=(const Motion&) = delete;

  /// run_scan() and the end, also by an exception; `job.result.left` is what was seen last.
  void run(ScanJob& job);
  /// Does the arm rest? Its encoders say the same for a while, within the rig's rest timeout; works without angles too.
  /// What must be cut is told where it takes no stop, says nothing, or goes on.
  EndState look(bool laser_dark);
  void end() noexcept;
  /// How laser and arm were left; nothing if they were not touched.
  const std::optional<EndState>& left() const { return left_; }

 private:
  Backend& backend_;
  const SafetySettings safety_;
  Progress& progress_;
  std::optional<EndState> left_;
  bool looked_ = false, ended_ = false;
};

struct ArmTarget {
  std::string name;  ///< of the motion, for progress and messages: "move elbow"
  JointVector q = JointVector::Zero();
  double velocity = 0;  ///< of the fastest joint [rad/s]
};

/// Where to, from where the arm is.
using TargetFrom = std::function<ArmTarget(const RigConfig& rig, const JointVector& now)>;

/// Checks the motion against limits, speeds and obstacles, moves, and prints where the arm came to rest. Returns kOk;
/// kPartial if it was stopped by a signal; kFailure after a fault, or if rest or darkness is not confirmed.
/// `hold_to_run`: an operator on a terminal, asked beforehand, holds a key; let go, it is stopped.
/// Errors: InputError or StoppedEarly before anything moves.
int move_arm(const ArmCommandOptions& options, const TargetFrom& target_from, bool hold_to_run);

}  // namespace tankrig::app
