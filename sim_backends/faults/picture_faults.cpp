#include "sim_backends/faults/picture_faults.hpp"

namespace tankrig::sim {

cv::Mat PictureFaults::spoilt(cv::Mat picture, std::uint64_t number, Stamp now) {
  const auto active = [&](FaultKind kind) { return script_.active(FaultDevice::kCamera, kind, now, camera_); };
  if (active(FaultKind::kStuck) && !last_.empty())
    picture = last_;
  else
    last_ = picture;
  if (const FaultSpec* garbage = active(FaultKind::kGarbage)) {
    cv::RNG random(garbage->seed + number);
    picture = cv::Mat(picture.size(), picture.type());
    random.fill(picture, cv::RNG::UNIFORM, 0, 256);
  }
  if (active(FaultKind::kWrong)) picture = cv::Mat::zeros(picture.size(), picture.type());
  return picture;
}

}  // namespace tankrig::sim
