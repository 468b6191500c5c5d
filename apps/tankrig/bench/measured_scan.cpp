#include "apps/tankrig/bench/measured_scan.hpp"

#include <tbb/parallel_for.h>

#include "pipeline/score_session.hpp"

namespace tankrig::app {

Ceiling MeasuredScan::ceiling(const ObjectSurface& object, const std::string& eyes,
                              const MetricThresholds& thresholds) const {
  const std::lock_guard lock(mutex_);
  auto [known, is_new] = ceilings_.try_emplace(eyes);
  if (is_new) known->second = session_ceiling(recorded(), object, eyes, thresholds);
  return known->second;
}

Session MeasuredScan::session(const PictureConditions& conditions, bool laser, bool stereo) const {
  Session out = recorded();
  const CalibratedCamera* mono = out.find_camera(CameraRole::kMono);
  std::vector<cv::Mat> pictures(out.frames.size());
  tbb::parallel_for(std::size_t{0}, out.frames.size(), [&](std::size_t i) {
    const bool of_mono = mono && out.frames[i].camera == mono->name;
    if (of_mono ? laser : stereo) pictures[i] = picture(out.frames[i], conditions);
  });
  for (std::size_t i = 0; i < pictures.size(); ++i)
    if (!pictures[i].empty()) out.unwritten[out.frames[i].file] = pictures[i];
  return out;
}

}  // namespace tankrig::app
