// The rig's true state while one frame is exposed.
#pragma once

#include <array>
#include <cstdint>

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig::sim {

struct Exposure {
  static constexpr int kSamples = 3;      ///< times in the exposure interval, evenly spaced, mid-interval rule
  std::array<JointVector, kSamples> q{};  ///< joints at those times
  std::array<double, kSamples> laser{};   ///< emitted power at those times, 0 .. 1 of the projector's
  Stamp mid{};                            ///< moves the floating particles
  std::uint64_t index = 0;                ///< with seed and camera name: seeds noise and speckle
};

/// Asks `joints_at` and `laser_at`, functions of a Stamp, at the times of an exposure that lasts `duration` around
/// `mid`.
template <class JointsAt, class LaserAt>
Exposure sample_exposure(Stamp mid, Duration duration, std::uint64_t index, JointsAt joints_at, LaserAt laser_at) {
  Exposure e;
  e.mid = mid;
  e.index = index;
  const Stamp begin = mid - duration / 2;
  for (std::size_t i = 0; i < Exposure::kSamples; ++i) {
    const Stamp t = begin + duration * (2 * static_cast<std::int64_t>(i) + 1) / (2 * Exposure::kSamples);
    e.q[i] = joints_at(t);
    e.laser[i] = laser_at(t);
  }
  return e;
}

}  // namespace tankrig::sim
