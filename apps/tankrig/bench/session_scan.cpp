#include "apps/tankrig/bench/session_scan.hpp"

#include <cmath>
#include <opencv2/core.hpp>

#include "apps/tankrig/bench/scan_trace.hpp"
#include "core/text_files.hpp"
#include "rig/scan/replay.hpp"

namespace tankrig::app {
namespace {

// The reference module's (its FogAdderBagPlayer): 1 / ln 2, and its colour in red, green, blue.
constexpr double kInverseLn2 = 1.442695;
constexpr double kFogColour[] = {0.0, 0.05, 0.3};

/// A picture of 8 bits, grey or BGR; its bits stay without fog.
cv::Mat in_fog(const cv::Mat& picture, const Fog& fog) {
  const double seen = std::exp(-kInverseLn2 * fog.density * fog.density * fog.distance_m * fog.distance_m);
  const auto [red, green, blue] = kFogColour;
  const cv::Scalar veil =
      picture.channels() == 3 ? cv::Scalar(blue, green, red) : cv::Scalar(0.299 * red + 0.587 * green + 0.114 * blue);
  std::vector<cv::Mat> channels;
  cv::split(picture, channels);
  for (std::size_t c = 0; c < channels.size(); ++c)
    channels[c].convertTo(channels[c], CV_8U, seen, (1 - seen) * 255 * veil[static_cast<int>(c)]);
  cv::Mat out;
  cv::merge(channels, out);
  return out;
}

}  // namespace

std::optional<double> mean_lux(const SessionInfo& info) {
  if (!info.lux_before) return std::nullopt;
  return (*info.lux_before + info.lux_after.value_or(*info.lux_before)) / 2;
}

SessionScan::SessionScan(OpenedSession opened, const RigConfig& rig) : opened_(std::move(opened)) {
  const RecordedScan scan = read_recorded_scan(opened_.session);
  trace_ = trace_of_scan(rig, scan.plan, scan.plan_zero, scan.joints, opened_.session, mean_lux(opened_.session.info));
  rig_yaml_ = read_whole_file(opened_.session.path / "rig.yaml");
}

cv::Mat SessionScan::picture(const FrameRecord& frame, const PictureConditions& conditions) const {
  const cv::Mat recorded = opened_.session.image(frame);
  return conditions.fog ? in_fog(recorded, *conditions.fog) : recorded;
}

Session SessionScan::session(const PictureConditions& conditions, bool laser, bool stereo) const {
  if (!conditions.fog) return opened_.session;  // its pictures are read where they are needed
  return MeasuredScan::session(conditions, laser, stereo);
}

std::optional<double> SessionScan::lux(const PictureConditions&) const { return mean_lux(opened_.session.info); }

}  // namespace tankrig::app
