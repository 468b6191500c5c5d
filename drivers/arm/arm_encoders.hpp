// The arm's five encoders: believed readings, whether they follow the demands, and the resulting joint state.
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

  /// Each joint is demanded to move at this speed from `now` on.
  void demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept;

  /// How many of an answer's readings were rejected, and how many encoders have lost their reference.
  struct Doubts {
    int rejected = 0, jumped = 0;
  };
  /// Takes the readings of the joints in `has`. `stalled`: the arm draws its stall current.
  Doubts take(const ArmReadings& readings, const ArmExchange& has, bool stalled) noexcept;
  /// Starts again; the zeros stay.
  void restart() noexcept;
  void set_zero(const std::array<std::uint16_t, kJoints>& raw) noexcept;

  /// Whether every encoder is believed.
  bool started() const noexcept;
  /// Whether one repeats its reading though it is driven.
  bool frozen() const noexcept { return evidence_.frozen(); }
  const EncoderTrack& operator[](std::size_t joint) const noexcept { return tracks_[joint]; }
  std::array<std::uint16_t, kJoints> raw() const noexcept;
  std::array<double, kJoints> ticks() const noexcept;
  /// State as of `readings`. Angles are numbers only if `homed`.
  JointState state(const ArmModel& model, const ArmReadings& readings, bool homed) const noexcept;

 private:
  std::array<EncoderTrack, kJoints> tracks_;
  MotionEvidence evidence_;
};

}  // namespace tankrig
