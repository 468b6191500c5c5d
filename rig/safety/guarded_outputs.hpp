// Laser and arm behind the safety step: the rig's only way to either.
#pragma once

#include <optional>

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/safety/laser_interlock.hpp"
#include "rig/safety/safety_settings.hpp"
#include "rig/safety/step_watch.hpp"

namespace tankrig {

InterlockLimits interlock_limits(const SafetySettings& settings) noexcept;

/// Runs the safety step and acts on it. A permission is good for one command: light and motion each need a new step,
/// and none is given in a dying program. Off, stop and rest are always allowed. Its destructor switches the laser off,
/// then stops the arm. The type of its right lets nobody else move an arm.
/// Threads: one, the cycle's; construction and destruction in another; exceptions are marked.
/// RT: all but construction and destruction.
class GuardedOutputs {
 public:
  /// `arm` and `laser` outlive it. Commands nothing yet.
  GuardedOutputs(Arm& arm, Laser& laser, const SafetySettings& settings) noexcept
      : arm_(arm), laser_(laser), limits_(interlock_limits(settings)) {}
  ~GuardedOutputs();
  GuardedOutputs(const GuardedOutputs&) = delete;
  GuardedOutputs& operator=(const GuardedOutputs&) = delete;

  /// Who hears of completed steps: guardian and watchdog box; either may be null. They outlive this. Call before the
  /// first step.
  void tell(StepWatch* watch, WatchdogBox* box) noexcept {
    watch_ = watch;
    box_ = box;
  }

  /// Once per cycle, before any output.
  const InterlockOutputs& step(InterlockInputs in) noexcept;
  const InterlockState& state() const noexcept { return state_; }

  /// On if the step allows and wants light, else off. Sent only if the laser's driver last took something else.
  /// Errors: the driver's.
  Status switch_laser() noexcept;
  Status laser_off() noexcept;
  bool laser_commanded() const noexcept { return laser_on_; }

  /// Errors: the driver's; kRefused for a velocity other than rest if the step allows no motion: then the arm is
  /// stopped.
  Result<JointVector> move(const JointVector& velocity) noexcept;
  /// The same of axes whose angles are not known, where the step allows homing.
  Status home(const TickSpeeds& ticks_per_s) noexcept;
  Status arm_stop() noexcept {
    const Status done = arm_.stop();
    arm_took_ = done.ok();
    return done;
  }
  /// Once per cycle, after all outputs. The step is completed, and guardian and watchdog box hear of it, if the drivers of
  /// laser and arm took the last that they were told since step(). The only place that says so.
  bool complete() noexcept;

  /// Laser off, then arm stopped, when the cycle's thread hangs.
  /// Threads: any.
  void force_safe_past_cycle() noexcept {
    [[maybe_unused]] const Status dark = laser_.off();
    [[maybe_unused]] const Status rest = arm_.stop();
  }

  // What the devices say.
  Result<std::optional<JointState>> read_joints() noexcept { return arm_.try_read(); }
  Result<LaserState> read_laser() noexcept { return laser_.state(); }
  Duration laser_warm_up() const noexcept { return laser_.warm_up(); }

 private:
  Arm& arm_;
  Laser& laser_;
  const OutputRight right_;
  const InterlockLimits limits_;
  InterlockState state_{};
  InterlockOutputs allowed_{};                  // taken back once used
  bool laser_on_ = false;                       // last command the driver took
  bool laser_took_ = false, arm_took_ = false;  // the last command since step()
  StepWatch* watch_ = nullptr;
  WatchdogBox* box_ = nullptr;
};

}  // namespace tankrig
