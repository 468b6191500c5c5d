// The manipulator as the executive sees it: joint angles in, joint velocities out.
#pragma once

#include <array>
#include <optional>

#include "core/arm_model.hpp"
#include "core/joint_state.hpp"
#include "core/result.hpp"
#include "drivers/output_right.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

/// A speed of every actuator [ticks/s].
using TickSpeeds = std::array<int, kJoints>;

/// Anybody may stop it; only the holder of an OutputRight may move it.
/// Threads: one (the cycle's), except where said.
class Arm {
 public:
  virtual ~Arm() = default;

  /// Newest state not yet returned; nothing if there is no new one.
  /// RT: safe, never blocks.
  virtual Result<std::optional<JointState>> try_read() noexcept = 0;

  /// A set-point of rest. Unlike stop(), it reports that the arm cannot be driven.
  /// Errors: the driver's.
  Status rest() noexcept {
    const auto applied = write_velocity(OutputRight(), JointVector::Zero());
    return applied.ok() ? Status{} : Status{applied.error()};
  }

  /// Commands rest.
  /// RT: safe. May be called from any thread, also after a failure.
  virtual Status stop() noexcept = 0;

  /// The program is dying: demands rest, whatever its threads are doing; nothing else is demanded from here on. Call it
  /// repeatedly: one demand may be lost inside a request that a dead thread left half-sent.
  /// Threads: any, also during any other call.  Async-signal-safe; never blocks.
  virtual void last_resort() noexcept { [[maybe_unused]] const Status rest = stop(); }

  /// How often the carrier exchanges set-point and state. More than the cycle's rate is useless.
  virtual Duration exchange_period() const noexcept = 0;

  /// Threads: any, never the cycle's.
  virtual Statistics statistics() const { return {}; }

  /// Sets joint velocities [rad/s]; returns the velocities really applied (rounded, limited). They last until the next
  /// call; without one, the driver stops the arm after its watchdog time.
  /// RT: safe, never blocks.
  virtual Result<JointVector> write_velocity(const OutputRight& right, const JointVector& velocity) noexcept = 0;

  /// The same without angles, for homing.
  /// Errors: the driver's; kRefused where the encoders know their zeros.
  /// RT: safe, never blocks.
  virtual Status write_ticks(const OutputRight& /*right*/, const TickSpeeds& /*ticks_per_s*/) noexcept {
    return Error{ErrorCode::kRefused, 0, {}, "arm: its encoders know their zeros"};
  }
};

}  // namespace tankrig
