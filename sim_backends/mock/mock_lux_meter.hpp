// The lux meter of the simulated rig.
#pragma once

#include <cstdint>
#include <functional>

#include "core/clock.hpp"
#include "drivers/lux/lux_meter.hpp"

namespace tankrig::sim {

/// Threads: one.
class MockLuxMeter final : public LuxMeter {
 public:
  /// `illuminance`: lux at the meter, e.g. TankWorld::lux. `relative_noise`: one standard deviation, seeded.
  MockLuxMeter(std::function<double()> illuminance, const Clock& clock, double relative_noise = 0,
               std::uint64_t seed = 1)
      : illuminance_(std::move(illuminance)), clock_(clock), relative_noise_(relative_noise), state_(seed) {}

  Result<LuxReading> read(Duration timeout) override;

 private:
  std::function<double()> illuminance_;
  const Clock& clock_;
  double relative_noise_;
  std::uint64_t state_;
};

}  // namespace tankrig::sim
