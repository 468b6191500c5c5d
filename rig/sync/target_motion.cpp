#include "rig/sync/target_motion.hpp"

#include <cmath>

namespace tankrig {

double speed_on_target(const SyncTarget& target, const JointVector& q, const JointVector& velocity) noexcept {
  constexpr double kStep = 1e-3;  // [s]
  const auto distance = [&](double t) {
    return (target.arm.bMe(q + t * velocity) * target.ePl).distance(target.object_b);
  };
  return std::abs(distance(kStep) - distance(-kStep)) / (2 * kStep);
}

}  // namespace tankrig
