#include "apps/tankrig/calibrate/dark_frames.hpp"

#include <opencv2/imgproc.hpp>

#include "core/input_error.hpp"

namespace tankrig::app {

std::vector<std::vector<const FrameRecord*>> dark_frames_by_pass(const Session& session, const std::string& camera) {
  std::vector<std::vector<const FrameRecord*>> passes;
  for (const FrameRecord& frame : session.frames) {
    if (frame.camera != camera || frame.laser_on || frame.phase == Phase::kSweep || frame.phase == Phase::kMove)
      continue;
    const auto pass = static_cast<std::size_t>(frame.pass);
    if (passes.size() <= pass) passes.resize(pass + 1);
    passes[pass].push_back(&frame);
  }
  return passes;
}

cv::Mat mean_picture(const Session& session, const std::vector<const FrameRecord*>& frames) {
  cv::Mat sum;
  for (const FrameRecord* frame : frames) {
    const cv::Mat picture = session.image(*frame);
    if (sum.empty()) sum = cv::Mat::zeros(picture.size(), CV_MAKETYPE(CV_32F, picture.channels()));
    cv::accumulate(picture, sum);
  }
  cv::Mat mean;
  sum.convertTo(mean, CV_8U, 1 / static_cast<double>(frames.size()));
  return mean;
}

cv::Mat grey_of(const cv::Mat& picture) {
  cv::Mat grey = picture;
  if (picture.channels() == 3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

cv::Mat dark_picture(const Session& session, const std::string& camera) {
  std::vector<const FrameRecord*> dark;
  for (const auto& pass : dark_frames_by_pass(session, camera)) dark.insert(dark.end(), pass.begin(), pass.end());
  if (dark.empty())
    throw InputError(session.path, "holds no frames of camera " + camera + " in the dark, expected some");
  return mean_picture(session, dark);
}

}  // namespace tankrig::app
