// The arm's five encoders: what each is believed to read, whether they move with what is demanded, and the joint state
// that follows.
#pragma once

#include <array>

#include "core/joint_state.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/arm/arm_readings.hpp"
#include "drivers/arm/motion_evidence.hpp"

namespace tankrig {

/// Threads: one.
/// RT: safe.
class ArmEncoders {
 public:
  explicit ArmEncoders(const Arm5eSettings& settings);

  /// From `now` on each joint shall move so fast.
  void demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept;

  /// How many of an answer's readings were not believed, and how many encoders have lost their reference.
  struct Doubts {
    int rejected = 0, jumped = 0;
  };
  /// The readings of `has`. `stalled`: the arm draws what it draws at a stop.
  Doubts take(const ArmReadings& readings, const ArmExchange& has, bool stalled) noexcept;
  /// Begins anew; the zeros stay.
  void restart() noexcept;
  void set_zero(const std::array<std::uint16_t, kJoints>& raw) noexcept;

  /// Is every one of them believed?
  bool started() const noexcept;
  /// Does one repeat what it read though it is driven?
  bool frozen() const noexcept { return evidence_.frozen(); }
  const EncoderTrack& operator[](std::size_t joint) const noexcept { return tracks_[joint]; }
  std::array<std::uint16_t, kJoints> raw() const noexcept;
  std::array<double, kJoints> ticks() const noexcept;
  /// As of `readings`. Angles are numbers where the arm is `homed`.
  JointState state(const ArmModel& model, const ArmReadings& readings, bool homed) const noexcept;

 private:
  std::array<EncoderTrack, kJoints> tracks_;
  MotionEvidence evidence_;
};

}  // namespace tankrig
