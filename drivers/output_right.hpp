// The right to move an arm and to light a laser. rig/safety holds it, behind its safety step; nobody else may include this
// file (tests/architecture).
#pragma once

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"

namespace tankrig {

/// Threads: as write_velocity() and set().
/// RT: safe, never blocks.
class OutputRight {
 public:
  /// Joint velocities [rad/s]; returns the velocities really applied.
  Result<JointVector> move(Arm& arm, const JointVector& velocity) const noexcept {
    return arm.write_velocity(velocity);
  }
  Status light(Laser& laser, bool on) const noexcept { return laser.set(on); }
};

}  // namespace tankrig
