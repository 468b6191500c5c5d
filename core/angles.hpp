// Degrees at the boundaries, radians within.
#pragma once

#include <numbers>

namespace tankrig {

constexpr double from_degrees(double degrees) noexcept { return degrees * (std::numbers::pi / 180); }
constexpr double to_degrees(double radians) noexcept { return radians * (180 / std::numbers::pi); }

}  // namespace tankrig
