// Two eyes on the tank: what the stereo pair sees and how its cameras stand to each other.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "core/camera_model.hpp"
#include "core/frames.hpp"

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

}  // namespace tankrig
