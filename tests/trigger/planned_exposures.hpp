// How many exposures a plan holds for a triggered camera that records everything.
#pragma once

#include <cmath>
#include <cstdint>

#include "rig/plan/scan_plan.hpp"

namespace tankrig::testing_support {

/// Whole periods in the recorded parts of dark blocks and, if asked for, of sweeps.
inline std::uint64_t planned_times(const ScanPlan& plan, double period, bool in_sweeps) {
  std::uint64_t times = 0;
  for (int k = 0; k * period < plan.duration(); ++k) {
    const Segment& s = plan.segments()[plan.segment_at(k * period)];
    const bool recorded = k * period >= s.record_begin && k * period <= s.record_end;
    times += s.phase != Phase::kMove && recorded && (in_sweeps || s.phase != Phase::kSweep);
  }
  return times;
}

/// Angles from the sweep's first to its last, of one pass.
inline std::uint64_t planned_angles(const ScanSettings& s, double spacing) {
  return static_cast<std::uint64_t>(std::floor(std::abs(s.sweep.to - s.sweep.from) / spacing + 1e-6)) + 1;
}

}  // namespace tankrig::testing_support
