// Faults that make the arm unfit to be driven.
#pragma once

#include <optional>

#include "core/arm_model.hpp"
#include "core/result.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/arm/arm_readings.hpp"

namespace tankrig {

enum class ArmFault : std::uint8_t { kNone, kOverCurrent, kWater, kEncoder, kPosture, kSuspended };

/// The first fault is kept: it is reported once, and refuses set-points until the program ends or homing cures it.
/// Threads: one.
/// RT: safe.
class ArmFaults {
 public:
  /// `settings` outlive it.
  explicit ArmFaults(const Arm5eSettings& settings) : settings_(settings) {}

  /// The fault that the readings show; the caller raises it.
  ArmFault seen_in(const ArmReadings& readings) noexcept;
  /// True if there was no fault before.
  bool raise(ArmFault fault) noexcept;
  /// The fault, on the first call after raise().
  std::optional<Error> tell(Stamp now) noexcept;
  /// Refusal of a set-point; `homing` may drive if homing is the cure.
  Status refusal(Stamp now, bool homing) const noexcept;
  /// Homing has begun, or has ended well.
  void reference_found() noexcept;

 private:
  const Arm5eSettings& settings_;
  ArmFault fault_ = ArmFault::kNone;
  bool told_ = true;
  OverCurrentWatch current_;
};

/// Whether a joint is farther outside its limits than `margin` [rad]. An endless joint never is.
/// RT: safe.
bool outside_limits(const ArmModel& model, const JointVector& q, double margin) noexcept;

}  // namespace tankrig
