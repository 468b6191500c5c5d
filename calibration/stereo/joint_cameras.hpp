// All cameras of a rig at once: the lenses and places that fit every picture any of them took of a target.
#pragma once

#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.hpp"

namespace tankrig {

struct JointCameras {
  BoardBundle bundle;
  double rms = 0;                               ///< per corner [px]
  std::vector<CameraParameters> sigma;          ///< camera by camera; 0: held
  std::vector<std::vector<double>> port_sigma;  ///< likewise of PortParameters; empty without a port
  std::vector<Eigen::Matrix<double, 6, 6>>
      covariance;                     ///< of a step of kMc: a rotation about the axes of k, then a translation
  std::vector<std::string> left_out;  ///< boards, and why
};

/// `start`: cameras and kMc are a first guess. A view may lack boards of some cameras, where they did not see it. Boards
/// that fit far worse than most are left out.
/// Threads: one. The same problem gives the same bits.
/// Errors: InputError if the target looks the same when turned, so that cameras may read it differently; if the corners do not
/// tell everything, or do not converge.
JointCameras refine_together(BoardBundle start);

}  // namespace tankrig
