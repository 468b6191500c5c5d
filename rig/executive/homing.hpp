// Finding the zeros of relative encoders: each axis is driven into its stop, under the safety step.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "core/clock.hpp"
#include "drivers/arm/arm5e.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/plan/scan_settings.hpp"
#include "rig/safety/step_watch.hpp"

namespace tankrig {

/// What homing is doing, for the screen.
struct HomingProgress {
  enum class Phase : std::uint8_t { kWaitingForBox, kDriving, kBackingOff, kTouching, kPausing, kDone };
  Joint joint = kSlew;
  Phase phase = Phase::kDriving;
  std::uint16_t raw = 0;
  double current_a = 0;
};
using HomingCallback = std::function<void(const HomingProgress&)>;

struct HomedAxis {
  std::uint16_t raw_at_stop = 0;
  std::uint16_t raw_at_zero = 0;             ///< at tick 0 of the actuator
  double angle_at_stop = 0;                  ///< rad
  double current_a = 0;                      ///< when the stop was found
  int fast_stop_ticks = 0;                   ///< where the fast approach found the stop, from where the slow one did
  std::optional<int> from_expected_ticks{};  ///< the zero, from where it was expected; nothing if it was not
};

struct HomingResult {
  std::array<std::optional<HomedAxis>, kJoints> axes;
  std::optional<Error> error;  ///< the arm's, or what homing says of the joint below
  std::string detail;          ///< what the error's words leave out
  Joint failed = kSlew;

  bool ok() const { return !error; }
  ArmZero zero() const;
  /// "elbow: arm: no stop found in its time".
  std::string message() const;
};

/// Everything homing needs; nothing is owned.
struct HomingJob {
  Arm5e& arm;
  Laser& laser;
  Clock& clock;
  const ScanSettings& settings;            ///< its limits, safety and heartbeat
  const std::atomic<bool>& stop;           ///< looked at every few milliseconds
  std::function<bool()> interlock_closed;  ///< as the backend reads it; empty is open
  HomingCallback progress = {};
  WatchdogBox* box = nullptr;  ///< watches every completed step; null: the rig has none
  StepWatch* watch = nullptr;  ///< likewise, and may object
};

/// Drives slew, shoulder, elbow, jaw rotation and jaw opening into their stops, one after the other, as the arm's
/// settings say: fast, back, and slowly again. If all went well, the arm gets its new zero.
/// Every step takes a permit of the safety step: watchdog box enabled, interlock closed, laser dark, actuators' speed and the arm's current
/// within their limits, no stop asked for, and no gap between two steps of more than the heartbeat's time-out. An axis
/// is given up that travels beyond its range, or whose fast and slow stop, or whose zero and the one that still held,
/// differ. However it ends, the laser is told off and the arm to rest.
/// Threads: takes the place of the cycle.
/// RT: never.
/// Errors: InputError before anything moves, where the settings contradict each other.
HomingResult home_axes(const HomingJob& job);

}  // namespace tankrig
