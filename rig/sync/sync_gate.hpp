// How well a frame's joints must be known: the rig file's `scan: sync:` section.
#pragma once

#include "core/time.hpp"

namespace tankrig {

/// A frame beyond either limit is refused.
/// Units: SI. The default time accepts a woven PAL frame (sigma 10 ms) with an arm that answers 75 times a second.
struct SyncGate {
  /// How many of its standard deviations a stamp may be off. Two cover any uniform error (an arrival between two polls,
  /// an unknown exposure: the square root of 3), and 95 % of a normal one.
  static constexpr double kSigmas = 2;

  double max_residual = 0.04;             ///< worst() of a frame [s]
  double max_residual_on_target = 0.005;  ///< how far the laser plane moves at the object in worst() [m]

  /// Time to the nearer joint sample plus the possible error of the frame's own stamp [s].
  static constexpr double worst(Duration residual, Duration stamp_sigma) noexcept {
    return seconds(residual) + kSigmas * seconds(stamp_sigma);
  }
};

}  // namespace tankrig
