// The laser line projector behind its supply relay.
#pragma once

#include <optional>

#include "core/result.hpp"
#include "drivers/output_right.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

/// The answer to "is the laser on?", from any device. If there is only an error, nobody knows.
struct LaserState {
  bool commanded = false;                  ///< last set()
  bool powered = false;                    ///< relay closed, by read-back if the device has it
  bool emitting = false;                   ///< powered, and warm-up over
  Stamp since{};                           ///< when `emitting` or, if off, `powered` last changed
  std::optional<bool> interlock_closed{};  ///< the interlock's loop, if the device reads it

  /// Certainly no light.
  bool dark() const noexcept { return !powered && !emitting; }
};

/// Anybody may switch it off; only the holder of an OutputRight may switch it on.
/// Threads: off() from any thread; the rest from one.
class Laser {
 public:
  virtual ~Laser() = default;
  /// Takes effect at once.
  /// RT: safe (queued to the device's thread), never blocks.
  Status off() noexcept { return set(false); }
  /// Emits after warm_up().
  /// RT: as off().
  Status on(const OutputRight& /*right*/) noexcept { return set(true); }
  virtual Result<LaserState> state() noexcept = 0;
  virtual Duration warm_up() const noexcept = 0;
  /// The program is dying: switches off, whatever its threads are doing, for good. Call it repeatedly: one byte may be
  /// lost inside a request that a dead thread left half-sent.
  /// Threads: any, also during any other call.  Async-signal-safe; never blocks.
  virtual void last_resort() noexcept { [[maybe_unused]] const Status dark = set(false); }
  /// Threads: any, never the cycle's.
  virtual Statistics statistics() const { return {}; }

 protected:
  virtual Status set(bool on) noexcept = 0;
  /// For a laser that wraps another.
  static Status set(Laser& behind, bool on) noexcept { return behind.set(on); }
};

}  // namespace tankrig
