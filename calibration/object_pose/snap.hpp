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
  std::string why_not;   ///< it stayed as clicked: too few edges seen, or they meet too far away; empty: it moved
  int edges = 0;         ///< that meet in it
};

/// Searches along the object's edges, as the pose expects them, for the strongest step in brightness, fits a robust line to each edge
/// in the undistorted picture and puts each corner where its lines meet.
/// `reach_px`: how far from its expected place an edge may be.
std::vector<SnappedCorner> snap(const cv::Mat& grey, const CameraModel& camera, const ObjectShape& shape,
                                const Transform& cMo, const std::vector<ClickedCorner>& clicked, double reach_px);

/// Pose from clicks, snapped twice: from the clicks' pose, then from the better one.
struct SnappedPose {
  ObjectPoseSolution raw, snapped;
  std::vector<SnappedCorner> corners;
};

/// Errors: as solve().
SnappedPose solve_with_snapping(const cv::Mat& grey, const ObjectPoseProblem& problem);

}  // namespace tankrig
