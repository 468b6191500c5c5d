// Which pictures of the tank the guest's camera shows: the rig's posture with the elbow on a fine grid, laser on.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/arm_model.hpp"

namespace tankrig::test {

inline constexpr double kFirstElbow = 1.58, kElbowStep = 0.001;  // [rad]
inline constexpr int kLitPictures = 341;                         // up to 1.92 rad
inline constexpr int kDarkPictures = 4;                          // laser off, noise of their own; the first of all

inline JointVector joints_of_lit_picture(int i) {
  return (JointVector() << 0, 0.13, kFirstElbow + i * kElbowStep, 0, 0.1).finished();
}

/// By their order in the folder.
inline std::size_t lit_picture(double elbow) {
  const long i = std::lround((elbow - kFirstElbow) / kElbowStep);
  return static_cast<std::size_t>(kDarkPictures + std::clamp<long>(i, 0, kLitPictures - 1));
}

}  // namespace tankrig::test
