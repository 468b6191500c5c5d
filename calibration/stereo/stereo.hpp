// Two cameras and how they stand to each other, from pictures that both took of the same target at the same moments.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.hpp"
#include "core/camera_file.hpp"

namespace tankrig {

/// Both pictures of one moment.
struct BoardPair {
  std::string name;
  FoundBoard left, right;
};

struct StereoProblem {
  cv::Size left_size, right_size;
  BoardTarget target;
  std::vector<BoardPair> pairs;
  std::optional<LensModel> lens;  ///< of both; nothing: each the simplest that fits, then the richer for both
  std::optional<bool> bends;
  std::optional<FlatPort> port = std::nullopt;  ///< as for one camera: each eye may look through one like it
  std::optional<CameraModel> left_in_air = std::nullopt, right_in_air = std::nullopt;  ///< held together, or not at all
};

struct StereoSolution {
  IntrinsicsSolution left, right;  ///< each camera by itself
  BoardBundle bundle;              ///< both together; camera 0 is the left one (c), camera 1 the right one (r)
  ResidualNoise noise;
  double rms_left = 0, rms_right = 0;  ///< of each camera by itself, per corner [px]
  double rms_stereo = 0;               ///< of both together, per corner
  std::vector<Estimate> left_estimates, right_estimates;
  Transform rMc = Transform::Identity();   ///< the left camera in the right: OpenCV's R and T
  std::vector<Estimate> translation;       ///< of rMc [m]: x, y, z
  std::vector<Estimate> rotation;          ///< of rMc: rotation vector [rad]
  Eigen::Matrix<double, 6, 6> covariance;  ///< of a step of rMc: a rotation about the axes of r, then a translation
  std::vector<std::string> left_out;       ///< pairs, and why
  std::vector<std::string> turned;         ///< pairs whose target was read the other way round in the right picture

  /// Rectified so that rows agree: how far they do not, over all corners [px].
  Rectification left_rectification, right_rectification;
  double row_rms = 0;
};

/// Threads: one. The same problem gives the same bits.
/// Errors: InputError as for one camera; also if the pairs do not agree on how the cameras stand: out of order, or one
/// camera mirrored.
StereoSolution solve(const StereoProblem& problem);

}  // namespace tankrig
