// Counts and last measurements of the arm's driver, readable by any thread.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "drivers/arm/arm_link.hpp"
#include "drivers/arm/arm_readings.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

/// Threads: whoever is inside the driver counts and publishes; any may read.
/// RT: all but statistics().
struct ArmCounts {
  using Count = std::atomic<std::uint64_t>;
  Count exchanges{0}, timeouts{0}, mute_retries{0}, late_answers{0}, stale{0}, jumps_rejected{0}, jumps{0},
      watchdog_stops{0}, over_currents{0}, water_alarms{0}, disconnects{0};

  void publish(const ArmLinkCounters& link, const ArmReadings& readings) noexcept;
  /// In the order above; then the link's counters and the supply.
  Statistics statistics() const;

 private:
  std::array<Count, 10> link_{};
  std::atomic<double> current_a_{0}, voltage_v_{0}, temperature_c_{0};
};

}  // namespace tankrig
