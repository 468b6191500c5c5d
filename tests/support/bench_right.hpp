// Tests drive a device without a rig around it; nothing else may.
#pragma once

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig {

struct BenchRight {
  static Result<JointVector> drive(Arm& arm, const JointVector& velocity) noexcept {
    return arm.write_velocity(OutputRight(), velocity);
  }
  static Status light(Laser& laser) noexcept { return laser.on(OutputRight()); }
  /// A safety step that there was not.
  template <class Watch>
  static void complete(Watch& watch) noexcept {
    watch.completed(OutputRight());
  }
  static Status drive_ticks(Arm& arm, const TickSpeeds& ticks_per_s) noexcept {
    return arm.write_ticks(OutputRight(), ticks_per_s);
  }
};

inline Result<JointVector> drive(Arm& arm, const JointVector& velocity) noexcept {
  return BenchRight::drive(arm, velocity);
}
inline Status drive_ticks(Arm& arm, const TickSpeeds& ticks_per_s) noexcept {
  return BenchRight::drive_ticks(arm, ticks_per_s);
}

}  // namespace tankrig
