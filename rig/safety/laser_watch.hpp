// Whether the laser's device obeys: not on when commanded off, not dark when commanded on.
#pragma once

#include <optional>

#include "drivers/laser/laser.hpp"
#include "rig/safety/safety_settings.hpp"

namespace tankrig {

/// Short phases add up too: a laser that switches with every frame is never long in one state.
/// Threads: one.
/// RT: safe.
class LaserWatch {
 public:
  explicit LaserWatch(const SafetySettings& settings) noexcept
      : off_allowance_(from_seconds(settings.laser_off_allowance)),
        on_margin_(from_seconds(settings.laser_on_margin)) {}

  /// `passed`: since the last call.
  std::optional<Error> look(const LaserState& laser, bool commanded, Duration warm_up, Stamp now,
                            Duration passed) noexcept {
    if (laser.dark())
      stray_ = Duration{0};
    else if (!commanded)
      stray_ += passed;
    if (laser.emitting)
      dark_ = Duration{0};
    else if (commanded)
      dark_ += passed;
    if (stray_ > off_allowance_) return Error{ErrorCode::kTimeout, 0, now, "laser: on though not commanded"};
    if (dark_ > warm_up + on_margin_) return Error{ErrorCode::kTimeout, 0, now, "laser: dark after its warm-up"};
    return std::nullopt;
  }

 private:
  const Duration off_allowance_, on_margin_;
  Duration stray_{}, dark_{};  // powered though not commanded, dark though commanded, for so long
};

}  // namespace tankrig
