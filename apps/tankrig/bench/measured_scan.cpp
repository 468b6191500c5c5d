#include "apps/tankrig/bench/measured_scan.hpp"

#include "pipeline/score_session.hpp"

namespace tankrig::app {

Ceiling MeasuredScan::ceiling(const ObjectSurface& object, const std::string& eyes,
                              const MetricThresholds& thresholds) const {
  const std::lock_guard lock(mutex_);
  auto [known, is_new] = ceilings_.try_emplace(eyes);
  if (is_new) known->second = session_ceiling(recorded(), object, eyes, thresholds);
  return known->second;
}

}  // namespace tankrig::app
