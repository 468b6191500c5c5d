// How well a frame's joints must be known: the rig file's `scan: sync:` section.
#pragma once

#include "core/time.hpp"

namespace tankrig {

/// A frame beyond either limit is refused.
/// Units: SI. The default time lets a woven PAL frame pass (sigma 10 ms) whose arm answers 75 times a second.
struct SyncGate {
  /// A stamp may be off by so many of its standard deviations: all of an error that is uniform (an arrival between two
  /// looks, an exposure that is not known: the square root of 3) and 95 % of one that is normal.
  static constexpr double kSigmas = 2;

  double max_residual = 0.04;             ///< worst() of a frame [s]
  double max_residual_on_target = 0.005;  ///< what the laser plane moves by at the object in worst() [m]

  /// Time to the nearer joint sample and what the frame's own stamp may be off by, together [s].
  static constexpr double worst(Duration residual, Duration stamp_sigma) noexcept {
    return seconds(residual) + kSigmas * seconds(stamp_sigma);
  }
};

}  // namespace tankrig
