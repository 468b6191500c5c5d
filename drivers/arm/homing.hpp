// Finding the zeros of relative encoders: each axis is driven into its stop.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "core/clock.hpp"
#include "drivers/arm/arm5e.hpp"

namespace tankrig {

/// What homing is doing, for the screen.
struct HomingProgress {
  enum class Phase : std::uint8_t { kDriving, kPausing, kDone };
  Joint joint = kSlew;
  Phase phase = Phase::kDriving;
  std::uint16_t raw = 0;
  double current_a = 0;
};
using HomingCallback = std::function<void(const HomingProgress&)>;
/// After each of its steps; what it returns ends homing.
using HomingStep = std::function<Status(Stamp now)>;

struct HomedAxis {
  std::uint16_t raw_at_stop = 0;
  std::uint16_t raw_at_zero = 0;  ///< at tick 0 of the actuator
  double angle_at_stop = 0;       ///< rad
  double current_a = 0;           ///< when the stop was found
};

struct HomingResult {
  std::array<std::optional<HomedAxis>, kJoints> axes;
  std::optional<Error> error;  ///< the arm's, or what homing says of the joint below
  Joint failed = kSlew;

  bool ok() const { return !error; }
  ArmZero zero() const;
  /// "elbow: arm: no stop found in its time".
  std::string message() const;
};

/// Drives slew, shoulder, elbow, jaw rotation and jaw opening into their stops, one after the other, as the arm's
/// settings say. If all went well, the arm gets its new zero. `stop` is checked every few milliseconds. However it
/// ends, the arm is told to rest.
/// Threads: takes the place of the cycle.
/// RT: never.
HomingResult home_axes(Arm5e& arm, Clock& clock, const std::atomic<bool>* stop = nullptr,
                       const HomingCallback& progress = {}, const HomingStep& stepped = {});

}  // namespace tankrig
