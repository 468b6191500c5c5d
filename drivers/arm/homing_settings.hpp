// How the arm finds its zeros: which way each axis is driven into its stop.
#pragma once

#include <array>

#include "core/arm_model.hpp"
#include "core/enum_names.hpp"
#include "core/time.hpp"

namespace tankrig {

/// kNone: the axis has no stop to find; where it stands is taken for its rest angle.
enum class HomeDirection : std::uint8_t { kNegative, kPositive, kNone };
template <>
inline constexpr std::array kNames<HomeDirection>{"negative", "positive", "none"};

/// Directions are of the actuator: negative makes ticks fewer. Source: the laboratory's public start-up file homes
/// slew, shoulder and elbow at speed 1500, negative, until the arm takes 1 A, with 5 s between axes; the wrist is not
/// homed.
struct HomingSettings {
  std::array<HomeDirection, kJoints> direction{HomeDirection::kNegative, HomeDirection::kNegative,
                                               HomeDirection::kNegative, HomeDirection::kNone, HomeDirection::kNone};
  std::array<double, kJoints> rest_angle{};  ///< of the axes without a stop [rad]
  int speed_ticks_per_s = 1500;
  double stop_current_a = 1;  ///< of the whole arm: above it, and at rest, the axis stands at its stop
  Duration pause = std::chrono::seconds(5);
  Duration longest = std::chrono::seconds(40);  ///< one axis; the longest, the shoulder, takes 15 s at 1500 ticks/s
};

}  // namespace tankrig
