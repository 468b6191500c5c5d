// The object's pose on the picture it was found in.
#pragma once

#include <opencv2/core.hpp>

#include "calibration/object_pose/snap.hpp"

namespace tankrig::app {

/// The paper's Figure 4: raw clicks red, snapped ones green, the object's edges as the pose has them.
cv::Mat object_picture(const cv::Mat& picture, const ObjectPoseProblem& problem, const SnappedPose& pose);

}  // namespace tankrig::app
