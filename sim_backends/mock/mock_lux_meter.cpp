#include "sim_backends/mock/mock_lux_meter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tankrig::sim {
namespace {

/// Uniform in (0, 1): splitmix64, the same on every machine.
double uniform(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return (static_cast<double>((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

}  // namespace

Result<LuxReading> MockLuxMeter::read(Duration) {
  double lux = illuminance_();
  if (relative_noise_ > 0) {
    const double radius = std::sqrt(-2 * std::log(uniform(state_)));
    lux = std::max(0.0, lux * (1 + relative_noise_ * radius * std::cos(2 * std::numbers::pi * uniform(state_))));
  }
  return LuxReading{clock_.now(), lux};
}

}  // namespace tankrig::sim
