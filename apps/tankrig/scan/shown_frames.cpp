#include "apps/tankrig/scan/shown_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "apps/tankrig/command_line/feed.hpp"
#include "bench/report/preview_picture.hpp"
#include "core/thread_priority.hpp"

namespace tankrig::app {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds{200};
constexpr double kSmooth = 0.2;  // of a period's newest value

}  // namespace

ShownFrames::ShownFrames() {
  if (Feed::one().heard()) thread_ = std::thread([this] { run(); });
}

ShownFrames::~ShownFrames() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
  std::unique_lock lock(mutex_);
  show_fresh(lock);
}

void ShownFrames::frame(const FrameRecord& record, const cv::Mat& image) {
  if (!thread_.joinable()) return;
  const std::lock_guard lock(mutex_);
  Shown& shown = cameras_[record.camera];
  shown.fresh = true;
  shown.laser = record.laser_on;
  shown.image = image;
  const double gap = seconds(record.stamp - shown.newest.stamp);
  if (gap > 0 && record.index == shown.newest.index + 1 && record.phase == shown.newest.phase &&
      record.pass == shown.newest.pass)
    shown.period_s += (shown.period_s > 0 ? kSmooth : 1) * (gap - shown.period_s);
  shown.newest = record;
  shown.caption = fmt::format("{}  frame {}", record.camera, record.index);
  if (!record.laser_on && record.phase == Phase::kDarkBefore) shown.dark = image;
}

void ShownFrames::run() {
  set_background("pictures");
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kPeriod, [this] { return ends_; })) show_fresh(lock);
}

void ShownFrames::show_fresh(std::unique_lock<std::mutex>& lock) {
  bool any = false;
  for (auto& [camera, shown] : cameras_) {
    if (!std::exchange(shown.fresh, false)) continue;
    Shown now = shown;
    lock.unlock();
    show(camera, now);
    lock.lock();
    shown.focus = now.focus;
    shown.best_focus = now.best_focus;
    shown.clipped_share = now.clipped_share;
    any = true;
  }
  if (any) show_cameras(views());
}

std::vector<CameraView> ShownFrames::views() const {
  std::vector<CameraView> views;
  for (const auto& [camera, shown] : cameras_) {
    CameraView view{.name = camera, .focus = shown.focus, .best_focus = shown.best_focus};
    view.clipped_share = shown.clipped_share;
    if (shown.period_s > 0) view.rate_hz = 1 / shown.period_s;
    if (shown.newest.exposure.count() > 0) view.exposure_ms = 1e3 * seconds(shown.newest.exposure);
    views.push_back(std::move(view));
  }
  return views;
}

void ShownFrames::show(const std::string& camera, Shown& shown) {
  PreviewMarks marks;
  shown.clipped_share = cv::countNonZero(clipped_mask(shown.image)) / static_cast<double>(shown.image.total());
  marks.focus = shown.focus = focus_of(shown.image);
  marks.best_focus = shown.best_focus = std::max(shown.best_focus, marks.focus);
  marks.laser = shown.laser;
  marks.caption = shown.caption;
  if (shown.laser) marks.stripe = stripe_points(shown.image, shown.dark);
  Feed::one().picture(camera, preview_picture(shown.image, marks));
}

}  // namespace tankrig::app
