// The lux meter beside the object.
#pragma once

#include "core/result.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

struct LuxReading {
  Stamp stamp{};
  double lux = 0;
};

/// Threads: one, never the cycle's.
/// RT: never.
class LuxMeter {
 public:
  virtual ~LuxMeter() = default;
  /// Waits for one reading, at most `timeout`.
  virtual Result<LuxReading> read(Duration timeout) = 0;
  virtual Statistics statistics() const { return {}; }
};

}  // namespace tankrig
