// The frames of a scan as whoever listens to the feed sees them: a few a second of each camera, marked.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <thread>
#include <vector>

#include "apps/tankrig/scan/camera_view.hpp"
#include "core/frame_record.hpp"

namespace tankrig::app {

/// Draws and sends in a thread of low priority, the newest frame of each camera: whoever records never waits for it. The
/// last frames are shown at the end, however busy the machine was.
/// Threads: frame() from one.
class ShownFrames {
 public:
  ShownFrames();
  ~ShownFrames();
  ShownFrames(const ShownFrames&) = delete;
  ShownFrames& operator=(const ShownFrames&) = delete;

  /// Shares `image`, which nobody may write to any more.
  void frame(const FrameRecord& record, const cv::Mat& image);

 private:
  struct Shown {
    bool fresh = false, laser = false;
    std::string caption;
    cv::Mat image, dark;
    FrameRecord newest;
    double period_s = 0;  ///< between two frames of one block, smoothed; 0: not known yet
    double focus = 0, best_focus = 0, clipped_share = 0;
  };
  void run();
  void show_fresh(std::unique_lock<std::mutex>& lock);
  static void show(const std::string& camera, Shown& shown);
  std::vector<CameraView> views() const;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::map<std::string, Shown> cameras_;
  std::thread thread_;
};

}  // namespace tankrig::app
