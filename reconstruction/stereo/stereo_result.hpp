// What a stereo method hands back: the cloud, and where every other pixel went.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

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
