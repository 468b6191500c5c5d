// What every stereo method is given, a calibrated pair of images, and what it hands back.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/camera_model.hpp"
#include "core/frames.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// Frames: left camera c, right camera r; pr = rMc * pc. A right camera that stands to the right has
/// rMc.translation().x() < 0.
struct StereoCalibration {
  CameraModel left;
  CameraModel right;
  Transform rMc = Transform::Identity();
};

/// Two images of one instant as the cameras gave them: 8-bit grey or BGR, distorted.
struct StereoPair {
  cv::Mat left;
  cv::Mat right;
  std::int32_t frame = -1;  ///< index in the left camera's sequence, -1 unknown
};

/// Pixels of the left image that gave no point, for one reason.
struct StereoRejection {
  std::string reason;
  std::size_t pixels = 0;
};

/// Frames: the cloud is in the left camera's frame c.
struct StereoResult {
  PointCloud cloud;
  int pairs = 0;           ///< image pairs that went into it
  std::size_t pixels = 0;  ///< of the rectified left image; points + all rejected
  std::vector<StereoRejection> rejected;
  double noise = 0;    ///< temporal noise of one image, one standard deviation [grey levels of 255]; 0 if not measured
  std::string reason;  ///< why the cloud is empty, e.g. "no texture above noise: 98 % of pixels"; empty if it is not
};

}  // namespace tankrig
