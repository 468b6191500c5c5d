// A plan's faults of a camera's pictures, on any carrier.
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

  /// The picture the camera shows instead of `picture`, which is shared: nobody may write to it afterwards.
  cv::Mat spoilt(cv::Mat picture, std::uint64_t number, Stamp now);

 private:
  std::string camera_;
  const FaultScript& script_;
  cv::Mat last_;
};

}  // namespace tankrig::sim
