// How punctual the cycle was, as a session keeps it: `timing` in session.yaml, and timing.csv.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/config_node.hpp"
#include "core/cycle_times.hpp"

namespace tankrig {

/// Percentiles of one quantity [us]; max is exact, the others at most 1.6 % too large.
struct TimingQuantity {
  double p50 = 0, p99 = 0, p999 = 0, max = 0;
};

struct SessionTiming {
  double cycle_hz = 0;
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;       ///< cycles that ran past the next grid point
  std::uint64_t missed_cycles = 0;  ///< grid points dropped for it
  TimingQuantity wake_up, execution, period;
};

SessionTiming session_timing(const CycleTimes& times, double cycle_hz);

/// `timing` of session.yaml.
extern const SettingsTable<SessionTiming> kSessionTimingKeys;

/// timing.csv: quantity,lower_us,upper_us,count; one line per non-empty bin.
std::string timing_csv(const CycleTimes& times);

/// A table of four lines for the screen.
std::string timing_table(const SessionTiming& timing);

/// For `session info`: name and value.
std::vector<std::pair<std::string, std::string>> timing_summary(const SessionTiming& timing);

}  // namespace tankrig
