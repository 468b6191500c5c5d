// One homing run: the arm exchanged with every few milliseconds through the guard, and the reasons to end it.
#pragma once

#include <optional>

#include "core/suspend_watch.hpp"
#include "rig/executive/homing.hpp"
#include "rig/safety/guarded_outputs.hpp"
#include "rig/safety/joint_monitor.hpp"
#include "rig/safety/laser_watch.hpp"

namespace tankrig {

/// Threads: one.
class HomingRun {
 public:
  using Phase = HomingProgress::Phase;

  explicit HomingRun(const HomingJob& job);

  /// The encoders are known from here on. A fault that homing ends is none yet.
  Status first_answer();
  /// Until the watchdog box is enabled; nothing may move before.
  Status wait_for_box();
  /// From here on axes may be driven, and their limits are watched.
  void begin() { begun_ = true; }
  /// Rests for so long.
  Status pause(Joint joint, Duration length);
  /// Until the axis stands; one that is driven, with more current than its stop current. 0: not driven.
  Result<HomedAxis> drive(Joint joint, int ticks_per_s, Phase phase);
  /// Out of a stop, until it is far enough.
  template <class Enough>
  Status leave(Joint joint, int ticks_per_s, Enough enough) {
    const Stamp begin = job_.clock.now();
    while (!enough()) {
      const auto news = step(joint, ticks_per_s);
      if (!news.ok()) return news.error();
      show(joint, Phase::kBackingOff);
      if (job_.clock.now() - begin > job_.arm.settings().homing.longest)
        return Error{ErrorCode::kTimeout, 0, job_.clock.now(), "arm: does not leave its stop"};
    }
    return {};
  }
  Status rest() { return guard_.arm_stop(); }
  void show(Joint joint, Phase phase);

  /// What a limit's error leaves out.
  const std::optional<JointViolation>& violation() const { return violation_; }

 private:
  /// Decides, sends the demand and waits a step: whether there are new readings, or why it cannot go on.
  Result<bool> step(Joint joint, int ticks_per_s);
  std::optional<Error> decide();
  /// An arm that is silent still, or a fault that homing ends.
  bool may_end(const Error& error) const noexcept {
    return read_failed_ && (error.code == ErrorCode::kTimeout || error.code == ErrorCode::kNotReady);
  }

  const HomingJob& job_;
  GuardedOutputs guard_;
  LaserWatch laser_watch_;
  JointMonitor monitor_;
  SuspendWatch suspend_watch_;
  std::optional<JointViolation> violation_;
  std::optional<Stamp> last_step_;
  bool begun_ = false, read_failed_ = false;
  Stamp shown_{};
};

}  // namespace tankrig
