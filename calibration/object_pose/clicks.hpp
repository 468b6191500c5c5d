// Whether clicked corners can be what they are said to be.
#pragma once

#include "calibration/object_pose/object_pose.hpp"

namespace tankrig {

/// Root mean square distance between clicked and expected corners [px]; infinite if one is behind the camera.
double clicks_rms(const CameraModel& camera, const std::vector<ClickedCorner>& corners, const Transform& cMo);

/// Errors: InputError: fewer than four corners, one outside of the picture, two at one place, all in a line.
void check_clicks(const ObjectPoseProblem& problem);

/// Errors: InputError if the best pose does not fit, with what would: two clicks swapped, all mirrored, another order; or if it fits
/// and the object hides one of its clicked corners.
void refuse_wrong_clicks(const ObjectPoseProblem& problem, const Transform& cMo, double rms_px);

/// Covariance of a step of cMo as that of a motion about and along the axes of o, at o's origin.
Eigen::Matrix<double, 6, 6> in_object(const Transform& cMo, const Eigen::Matrix<double, 6, 6>& covariance);

}  // namespace tankrig
