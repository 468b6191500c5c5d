// Joints at one moment, as the arm reports and a session keeps them.
#pragma once

#include <array>
#include <cstdint>

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig {

/// Joints as measured by the arm's encoders.
struct JointState {
  Stamp stamp{};                               ///< when the encoders were read, latency removed
  std::array<Duration, kJoints> age{};         ///< how much earlier this joint was read; 0: at `stamp`
  JointVector q = JointVector::Zero();         ///< rad
  JointVector velocity = JointVector::Zero();  ///< rad/s
  std::array<std::int32_t, kJoints> ticks{};   ///< raw, unwrapped
  double current_a = 0;                        ///< master supply current [A]
};

}  // namespace tankrig
