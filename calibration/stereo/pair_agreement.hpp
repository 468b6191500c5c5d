// How the right camera stands to the left one, by most pairs; and the pairs that say otherwise.
#pragma once

#include "calibration/stereo/stereo.hpp"

namespace tankrig {

struct PairAgreement {
  Transform rMc = Transform::Identity();
  std::vector<BoardPair> pairs;       ///< that agree; their right targets read the same way round as the left ones
  std::vector<std::string> left_out;  ///< that do not
  std::vector<std::string> turned;    ///< whose right target was turned onto itself to agree
};

/// Each pair alone gives rMc; that of the pair which most others agree with is taken.
/// Errors: InputError if a third of the pairs does not agree: out of order, or one camera's pictures mirrored. It says
/// which, if pairing each left picture with the next right one, or mirroring, would agree.
PairAgreement agree_on_pose(const CameraModel& left, const CameraModel& right, const BoardTarget& target,
                            const std::vector<BoardPair>& pairs);

}  // namespace tankrig
