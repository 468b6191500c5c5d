// A lux meter with a plan's faults between it and its user.
#pragma once

#include <optional>

#include "core/clock.hpp"
#include "drivers/lux/lux_meter.hpp"
#include "sim_backends/faults/fault_script.hpp"

namespace tankrig::sim {

/// Threads: one.
class FaultyLuxMeter final : public LuxMeter {
 public:
  /// All outlive it.
  FaultyLuxMeter(LuxMeter& meter, FaultScript& script, Clock& clock) : meter_(meter), script_(script), clock_(clock) {}

  Result<LuxReading> read(Duration timeout) override;
  Statistics statistics() const override { return meter_.statistics(); }

 private:
  LuxMeter& meter_;
  FaultScript& script_;
  Clock& clock_;
  std::optional<double> last_;
};

}  // namespace tankrig::sim
