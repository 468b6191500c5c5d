#include "pipeline/live_detector.hpp"

#include <algorithm>
#include <utility>

namespace tankrig {
namespace {

constexpr int kLooks = 7;  ///< frames that settle the stripe's look

}  // namespace

LiveDetector::LiveDetector(const CalibratedCamera& camera, const PipelineParameters& parameters)
    : camera_(camera), detector_(parameters.laser) {
  job_.detector = parameters.laser;
  job_.workspace = parameters.workspace;
}

void LiveDetector::add_dark(const cv::Mat& image) {
  dark_.push_back(image);
  background_.release();
}

void LiveDetector::learn_dark() {
  if (background_.empty() && !dark_.empty()) background_ = median_background(dark_);
}

void LiveDetector::learn(const cv::Mat& image) {
  learn_dark();
  if (looks_++ >= kLooks) return;
  StripeLook look = find_look(image, background_, detector_.orientation);
  if (looks_ == 1 || look.evidence > look_.evidence) look_ = std::move(look);
  scatters_ += measure_contrasts(image, background_, detector_, look_);
  look_.contrast = scatters_.best();
}

LiveLine LiveDetector::find_line(const cv::Mat& image, const FrameRecord& frame, const Plane& cPl) {
  learn(image);
  StripeFrame in_sweep;
  in_sweep.cPl = cPl;
  in_sweep.index = frame.index;
  in_sweep.aMc = camera_.bMc;
  StripeFrameResult result = reconstruct_frame(image, in_sweep, camera_.model, background_, job_, look_);
  LiveLine line;
  line.frame = frame.index;
  line.stamp = frame.stamp;
  line.columns = result.detection.statistics.columns;
  line.found = result.detection.peaks.size();
  line.clipped = static_cast<std::uint64_t>(
      std::ranges::count_if(result.detection.peaks, [](const StripePeak& peak) { return peak.intensity >= 1; }));
  line.points = std::move(result.points);
  return line;
}

}  // namespace tankrig
