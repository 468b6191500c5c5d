// The laser line projector behind its supply relay.
#pragma once

#include <optional>

#include "core/result.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

/// The one answer to "is the laser on?", from whatever device; where there is none but an error, nobody knows.
struct LaserState {
  bool commanded = false;                  ///< last set()
  bool powered = false;                    ///< relay closed, as read back where the device offers it
  bool emitting = false;                   ///< powered, and warm-up over
  Stamp since{};                           ///< when `emitting` or, if off, `powered` last changed
  std::optional<bool> interlock_closed{};  ///< the interlock's loop, where the device reads it

  /// Sure to give no light.
  bool dark() const noexcept { return !powered && !emitting; }
};

class OutputRight;

/// Anybody may switch it off; on is for who holds the right to it: OutputRight.
/// Threads: off() from any thread; the rest from one.
class Laser {
 public:
  virtual ~Laser() = default;
  /// Takes effect at once.
  /// RT: safe (queued to the device's thread), never blocks.
  Status off() noexcept { return set(false); }
  virtual Result<LaserState> state() noexcept = 0;
  virtual Duration warm_up() const noexcept = 0;
  /// The program is dying: off, whatever its threads are doing; it will not go on again. Call it again and
  /// again: a single byte may be lost in one that a dead thread left half-sent.
  /// Threads: any, also in the middle of any other call.  Async-signal-safe; never blocks.
  virtual void last_resort() noexcept { [[maybe_unused]] const Status dark = set(false); }
  /// Threads: any, never the cycle's.
  virtual Statistics statistics() const { return {}; }

 protected:
  friend OutputRight;
  /// On emits after warm_up(); the rest as off().
  virtual Status set(bool on) noexcept = 0;
  /// For a laser that stands before another.
  static Status set(Laser& behind, bool on) noexcept { return behind.set(on); }
};

}  // namespace tankrig
