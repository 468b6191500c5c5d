// Who is told of every completed safety step, and may object to the next one.
#pragma once

#include "core/time.hpp"
#include "drivers/output_right.hpp"

namespace tankrig {

/// Between begin() and release() a step must be completed again and again, else whoever watches makes safe by itself.
/// Threads: objection() and completed() the cycle's, begin() and release() any.
/// RT: safe.
class StepWatch {
 public:
  virtual ~StepWatch() = default;

  /// From the next completed step on, none may be later than `patience` after the one before.
  virtual void begin(Duration patience) noexcept = 0;
  /// Why nothing may move or shine any more, a string literal; null while all is well. For good.
  virtual const char* objection(Stamp now) noexcept = 0;
  /// A safety step has been decided, and laser and arm took what it decided. By its right, GuardedOutputs alone says so.
  virtual void completed(const OutputRight& right) noexcept = 0;
  /// Laser off and arm at rest are confirmed: no step is expected until the next begin().
  virtual void release() noexcept = 0;
};

}  // namespace tankrig
