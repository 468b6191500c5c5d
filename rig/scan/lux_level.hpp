// A level of light that an operator sets, and a lux meter confirms.
#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "core/clock.hpp"
#include "drivers/lux/lux_meter.hpp"

namespace tankrig {

struct LuxLevel {
  double lux = 0;
  double tolerance = 0.1;  ///< as a share of it, but at least kLeastTolerance

  static constexpr double kLeastTolerance = 1;  ///< [lx]: darkness is a level too
  double margin() const;                        ///< [lx]
  bool holds(double reading) const;
};

/// Reads the meter twice a second until three readings in a row hold the level: its last one. Nothing if `stop` was set
/// first. A meter that fails is asked again. `tell`: every reading, or why there was none.
std::optional<double> wait_for_level(LuxMeter& meter, Clock& clock, const LuxLevel& level,
                                     const std::atomic<bool>& stop,
                                     const std::function<void(const Result<LuxReading>&)>& tell);

}  // namespace tankrig
