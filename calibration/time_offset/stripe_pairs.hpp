// Places on the target that the stripe passed in both directions of a sweep, found in the image.
#pragma once

#include <vector>

#include "calibration/time_offset/time_offset.hpp"

namespace tankrig {

/// A stripe point of one direction, and the two frames of the other between which the stripe passed the same pixel.
struct StripePair {
  std::size_t single = 0, before = 0, after = 0;  ///< indices into the recording's stripes
  double weight = 0;  ///< inverse depth there = (1 - weight) * before's at x_before + weight * after's at x_after
  Vector3d x, x_before, x_after;  ///< rays through the pixels, z = 1, camera frame
  double sigma_s = 0;             ///< of the two crossings' difference in time, from the points' sigmas [s]
  int backward = 0;               ///< +1: `single` belongs to the direction of falling joint angle, -1: the others do
};

/// Mean joint velocity of every pass, by the joints nearest to its first and last stripe [rad/s].
struct PassMotion {
  int pass = 0;
  int joint = 0;        ///< the one that moves most
  double velocity = 0;  ///< signed
};
std::vector<PassMotion> pass_motions(const TimeOffsetRecording& recording);

/// Pairs of all passes in opposite directions. The order does not depend on anything but the recording's.
std::vector<StripePair> stripe_pairs(const TimeOffsetRecording& recording, const CameraModel& camera, bool rows);

}  // namespace tankrig
