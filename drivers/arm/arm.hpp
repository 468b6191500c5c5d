// The manipulator, as the executive sees it: joint angles in, joint velocities out.
#pragma once

#include <optional>

#include "core/joint_state.hpp"
#include "core/result.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

class OutputRight;

/// Anybody may stop it; motion is for who holds the right to it: OutputRight.
/// Threads: one (the cycle's), except where said.
class Arm {
 public:
  virtual ~Arm() = default;

  /// Newest state not yet returned; nothing if none has come since.
  /// RT: safe, never blocks.
  virtual Result<std::optional<JointState>> try_read() noexcept = 0;

  /// Asks for rest as a set-point: tells, where stop() does not, that the arm cannot be driven.
  /// Errors: the driver's.
  Status rest() noexcept {
    const auto applied = write_velocity(JointVector::Zero());
    return applied.ok() ? Status{} : Status{applied.error()};
  }

  /// Commands rest.
  /// RT: safe. May be called from any thread, also after a failure.
  virtual Status stop() noexcept = 0;

  /// The program is dying: rest, whatever its threads are doing; from here on nothing else is demanded. Call it again
  /// and again: a single demand may be lost in one that a dead thread left half-sent.
  /// Threads: any, also in the middle of any other call.  Async-signal-safe; never blocks.
  virtual void last_resort() noexcept { [[maybe_unused]] const Status rest = stop(); }

  /// How often the carrier exchanges set-point and state; at most the cycle's rate is useful.
  virtual Duration exchange_period() const noexcept = 0;

  /// Threads: any, never the cycle's.
  virtual Statistics statistics() const { return {}; }

 protected:
  friend OutputRight;
  /// Sets joint velocities [rad/s]; returns what is really applied (rounded, limited).
  /// RT: safe, never blocks. Lasts until the next call; a driver stops the arm by itself when none comes within its
  /// watchdog time.
  virtual Result<JointVector> write_velocity(const JointVector& velocity) noexcept = 0;
  /// For an arm that stands before another.
  static Result<JointVector> write_velocity(Arm& behind, const JointVector& velocity) noexcept {
    return behind.write_velocity(velocity);
  }
};

}  // namespace tankrig
