// Clicks moved to where the object's edges meet in the picture, to a part of a pixel.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "calibration/object_pose/object_pose.hpp"

namespace tankrig {

/// A corner after snapping.
struct SnappedCorner {
  ClickedCorner corner;  ///< pixel and sigma: of the edges' meeting, or as clicked
  std::string why_not;   ///< it stayed as clicked: too few edges seen, or they meet elsewhere; empty: it moved
  int edges = 0;         ///< that meet in it
};

/// Pose from clicks, snapped from the clicks' pose, then from better ones. Corners that disagree with five others stay as
/// clicked; all do if fewer than three can be snapped, or if together they contradict each other or the clicks: `snapped` is `raw` then.
struct SnappedPose {
  ObjectPoseSolution raw, snapped;
  std::vector<SnappedCorner> corners;
};

/// Errors: as solve().
SnappedPose solve_with_snapping(const cv::Mat& grey, const ObjectPoseProblem& problem);

}  // namespace tankrig
