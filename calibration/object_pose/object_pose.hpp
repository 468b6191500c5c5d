// Where the object stands to the camera, from clicked corners: the paper's ground truth.
//
// Every pose method of ViSP is tried and the one with the smallest reprojection error kept, as the paper does; from there the error is
// minimised. What the clicks cannot be is refused by name: swapped, mirrored, in a line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/estimate/estimate.hpp"
#include "calibration/object_pose/object_shape.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

/// A point of the object and where it was clicked.
struct ClickedCorner {
  std::string name;
  Vector3d o = Vector3d::Zero();  ///< in the object's frame [m]
  Vector2d pixel = Vector2d::Zero();
  double sigma = 1;  ///< of each coordinate of `pixel` [px]; only their ratios weigh
};

struct ObjectPoseProblem {
  CameraModel camera;
  std::vector<ClickedCorner> corners;
  ObjectShape shape;
  double most_rms_px = 6;  ///< beyond it the clicks are taken for wrong
};

struct PoseMethod {
  std::string name;     ///< ViSP's
  std::string failure;  ///< empty: an answer
  Transform cMo = Transform::Identity();
  double rms_px = 0;
  double rotation = 0;     ///< from the refined pose [rad]
  double translation = 0;  ///< likewise, of the object's origin [m]
};

/// Another pose that fits the clicks nearly as well.
struct RivalPose {
  Transform cMo = Transform::Identity();
  double rms_px = 0;
  double rotation = 0;  ///< from the pose taken [rad]
};

struct ObjectPoseSolution {
  Transform cMo = Transform::Identity();
  std::vector<Estimate> parameters;        ///< rotation about, and translation along, the camera's axes
  Eigen::Matrix<double, 6, 6> covariance;  ///< of `parameters` as a step from cMo
  double rms_px = 0;                       ///< per corner
  double sigma_px = 0;                     ///< of a click of sigma 1, by the residuals
  double degrees_of_freedom = 0;
  std::vector<Vector2d> residuals_px;  ///< of each corner: expected less clicked
  ObjectShape::SurfaceError surface;   ///< what the covariance moves the surface by, along its normals
  std::string start;                   ///< the method of the smallest error
  std::vector<PoseMethod> methods;
  std::optional<RivalPose> rival;
};

/// Threads: one at a time. Same input, same bits.
/// Errors: InputError that names the corners: too few, outside of the picture, one click twice, in a line, swapped, mirrored, hidden.
ObjectPoseSolution solve(const ObjectPoseProblem& problem);

}  // namespace tankrig
