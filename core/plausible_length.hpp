// Lengths that fit a tank. Longer ones were probably given in millimetres.
#pragma once

#include <cmath>

namespace tankrig {

inline constexpr double kLongestLength = 20;     ///< poses, planes, tank sides: from anything to anything else [m]
inline constexpr double kLongestReach = 5;       ///< from the end effector to the laser it carries [m]
inline constexpr double kLargestObject = 5;      ///< longest side of an object's mesh [m]
inline constexpr double kSmallestObject = 1e-3;  ///< likewise [m]

inline bool plausible_length(double metres) { return std::abs(metres) <= kLongestLength; }

/// What follows "found ...".
inline constexpr const char* kLooksLikeMillimetres =
    ", longer than a tank (20 m): looks like millimetres, expected metres";
inline constexpr const char* kLaserOutOfReach =
    ", farther from the end effector than a laser it carries (5 m): looks like millimetres, expected metres";

}  // namespace tankrig
