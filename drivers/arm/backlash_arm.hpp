// An arm whose joints report their links instead of their encoders: backlash between them is removed.
#pragma once

#include <array>

#include "drivers/arm/arm.hpp"

namespace tankrig {

/// The encoders sit at the actuators; a link trails its encoder by half the backlash in the direction of its last
/// motion. The encoder drags the link along, as in the real axis; until a joint has first moved by its backlash, its
/// link counts as in the middle. Commands, ticks and measured velocities pass unchanged.
/// Threads: those of the arm behind it.
/// RT: the same.
/// Errors: the same.
class BacklashArm final : public Arm {
 public:
  /// `arm` outlives it. `play_ticks`: from end to end, of every axis; 0 if unknown.
  BacklashArm(Arm& arm, const ArmModel& model, const std::array<double, kJoints>& play_ticks)
      : arm_(arm), model_(model), play_(play_ticks) {}

  Result<std::optional<JointState>> try_read() noexcept override;
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& velocity) noexcept override {
    return arm_.write_velocity(right, velocity);
  }
  Status write_ticks(const OutputRight& right, const TickSpeeds& ticks_per_s) noexcept override {
    return arm_.write_ticks(right, ticks_per_s);
  }
  Status stop() noexcept override { return arm_.stop(); }
  void last_resort() noexcept override { arm_.last_resort(); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }
  Statistics statistics() const override { return arm_.statistics(); }

 private:
  Arm& arm_;
  const ArmModel model_;
  const std::array<double, kJoints> play_;
  std::array<double, kJoints> link_{};  // ticks
  bool known_ = false;
};

}  // namespace tankrig
