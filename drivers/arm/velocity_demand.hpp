// Joint velocities as the arm's speed demands: rad/s through the actuators' geometry to ticks/s.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/arm_model.hpp"
#include "drivers/arm/joint_slot.hpp"

namespace tankrig {

/// Source of the defaults: the laboratory's public controller (docs/reference/arm5e.md).
struct VelocityShaping {
  double creep = 0.01;  ///< slower commands are rest [rad/s]
  JointVector dead_zone = (JointVector() << 0.06, 0.06, 0.06, 0.2, 0.1)
                              .finished();  ///< slower commands above creep are raised to it [rad/s]
  double max_ticks_per_s = 2000;            ///< all axes are slowed together when one exceeds it
};

struct VelocityDemand {
  std::array<double, kJoints> ticks_per_s{};  ///< whole numbers
  JointVector applied = JointVector::Zero();  ///< their velocity [rad/s]
};

/// dq/dticks, with its sign [rad/tick].
inline double signed_slope(const Actuator& actuator, double ticks) noexcept {
  return actuator.d == 0 ? actuator.rad_per_tick : actuator.sign * actuator.resolution(actuator.angle(ticks));
}

/// The demand for axes at `ticks`; nothing if a velocity is not a number.
/// RT: safe.
inline std::optional<VelocityDemand> velocity_demand(const ArmModel& model, const VelocityShaping& shaping,
                                                     const std::array<double, kJoints>& ticks,
                                                     const JointVector& velocity) noexcept {
  VelocityDemand demand;
  std::array<double, kJoints> slope{};
  double fastest = 0;
  for (std::size_t j = 0; j < kJoints; ++j) {
    double v = velocity[static_cast<int>(j)];
    if (!std::isfinite(v)) return {};
    const double dead_zone = shaping.dead_zone[static_cast<int>(j)];
    if (std::abs(v) < shaping.creep)
      v = 0;
    else if (std::abs(v) < dead_zone)
      v = std::copysign(dead_zone, v);
    slope[j] = signed_slope(model.actuators[j], ticks[j]);
    demand.ticks_per_s[j] = v / slope[j];
    fastest = std::max(fastest, std::abs(demand.ticks_per_s[j]));
  }
  const double scale = fastest > shaping.max_ticks_per_s ? shaping.max_ticks_per_s / fastest : 1;
  for (std::size_t j = 0; j < kJoints; ++j) {
    demand.ticks_per_s[j] = std::round(demand.ticks_per_s[j] * scale);
    demand.applied[static_cast<int>(j)] = demand.ticks_per_s[j] * slope[j];
  }
  return demand;
}

/// The demands that the wire can carry: none has the low byte 0x0A.
/// RT: safe.
inline void make_sendable(VelocityDemand& demand) noexcept {
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double asked = demand.ticks_per_s[j];
    if (asked == 0) continue;
    const double sent =
        std::copysign(sendable(static_cast<std::uint16_t>(std::min<double>(std::abs(asked), kLargestSpeed))), asked);
    demand.ticks_per_s[j] = sent;
    demand.applied[static_cast<int>(j)] *= sent / asked;
  }
}

}  // namespace tankrig
