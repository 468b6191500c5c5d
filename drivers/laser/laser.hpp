// The laser line projector behind its supply relay.
#pragma once

#include <optional>

#include "core/result.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

struct LaserState {
  bool commanded = false;                  ///< last set()
  bool powered = false;                    ///< relay closed, as read back where the device offers it
  bool emitting = false;                   ///< powered, and warm-up over
  Stamp since{};                           ///< when `emitting` or, if off, `powered` last changed
  std::optional<bool> interlock_closed{};  ///< the interlock's loop, where the device reads it
};

/// Threads: set(false) from any thread; the rest from one.
class Laser {
 public:
  virtual ~Laser() = default;
  /// Off takes effect at once; on emits after warm_up().  RT: safe (queued to the device's thread), never blocks.
  virtual Status set(bool on) noexcept = 0;
  virtual Result<LaserState> state() noexcept = 0;
  virtual Duration warm_up() const noexcept = 0;
  /// Threads: any, never the cycle's.
  virtual Statistics statistics() const { return {}; }
};

}  // namespace tankrig
