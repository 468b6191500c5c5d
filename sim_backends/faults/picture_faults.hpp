// What a plan does to the pictures of a camera, whatever carries them.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "sim_backends/faults/fault_script.hpp"

namespace tankrig::sim {

/// Stuck, garbage and wrong.
/// Threads: one.
class PictureFaults {
 public:
  PictureFaults(std::string camera, const FaultScript& script) : camera_(std::move(camera)), script_(script) {}

  /// What the camera shows instead of `picture`. The picture is shared: nobody writes to it afterwards.
  cv::Mat spoilt(cv::Mat picture, std::uint64_t number, Stamp now);

 private:
  std::string camera_;
  const FaultScript& script_;
  cv::Mat last_;
};

}  // namespace tankrig::sim
