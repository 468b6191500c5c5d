#include "rig/scan/lux_level.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr Duration kInterval = std::chrono::milliseconds(500);
constexpr int kSteady = 3;

}  // namespace

double LuxLevel::margin() const { return std::max(tolerance * lux, kLeastTolerance); }

bool LuxLevel::holds(double reading) const { return std::abs(reading - lux) <= margin(); }

std::optional<double> wait_for_level(LuxMeter& meter, Clock& clock, const LuxLevel& level,
                                     const std::atomic<bool>& stop,
                                     const std::function<void(const Result<LuxReading>&)>& tell) {
  for (int steady = 0; !stop;) {
    const Stamp begin = clock.now();
    const Result<LuxReading> reading = meter.read(std::chrono::seconds(2));
    tell(reading);
    steady = reading.ok() && level.holds(reading.value().lux) ? steady + 1 : 0;
    if (steady == kSteady) return reading.value().lux;
    clock.sleep_until(begin + kInterval);
  }
  return std::nullopt;
}

}  // namespace tankrig
