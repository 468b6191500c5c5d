// What makes the arm unfit to be driven until somebody has seen to it.
#pragma once

#include <optional>

#include "core/arm_model.hpp"
#include "core/result.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/arm/arm_readings.hpp"

namespace tankrig {

enum class ArmFault : std::uint8_t { kNone, kOverCurrent, kWater, kEncoder, kPosture, kSuspended };

/// The first fault is kept: told once, refusing set-points until the program ends or homing cures it.
/// Threads: one.
/// RT: safe.
class ArmFaults {
 public:
  /// `settings` outlive it.
  explicit ArmFaults(const Arm5eSettings& settings) : settings_(settings) {}

  /// What the readings themselves show; the caller raises it.
  ArmFault seen_in(const ArmReadings& readings) noexcept;
  /// True if none was there before.
  bool raise(ArmFault fault) noexcept;
  /// The first time after raise().
  std::optional<Error> tell(Stamp now) noexcept;
  /// Of a set-point; `homing` may drive where it is the cure.
  Status refusal(Stamp now, bool homing) const noexcept;
  /// A homing has begun or ended well.
  void reference_found() noexcept;

 private:
  const Arm5eSettings& settings_;
  ArmFault fault_ = ArmFault::kNone;
  bool told_ = true;
  OverCurrentWatch current_;
};

/// Is a joint farther outside its limits than `margin` [rad]? One that turns without end never is.
/// RT: safe.
bool outside_limits(const ArmModel& model, const JointVector& q, double margin) noexcept;

}  // namespace tankrig
