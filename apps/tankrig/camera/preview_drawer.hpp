// Draws a lit preview beside the supervisor's round: a large picture takes longer than the cycle waits for a heartbeat.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "apps/tankrig/camera/camera_preview_output.hpp"

namespace tankrig::app {

/// Hands frames to the output in their order. While one is drawn, the next is kept and the others are only counted.
/// Threads: one; in real time it owns another, which alone uses the output.
/// Errors: the output's, from a later call.
class PreviewDrawer {
 public:
  /// `output` outlives it. Not `beside`: draws in the caller's thread.
  PreviewDrawer(PreviewOutput& output, bool beside);
  ~PreviewDrawer();
  PreviewDrawer(const PreviewDrawer&) = delete;
  PreviewDrawer& operator=(const PreviewDrawer&) = delete;

  void add_background(const cv::Mat& image);
  void add(const cv::Mat& image, Stamp stamp, bool lit, const CameraCounters& counters);
  void finish_line();
  /// All is drawn when it returns.
  void end();

 private:
  struct Item {
    enum class Kind { kBackground, kFrame, kCount, kFinishLine } kind = Kind::kCount;
    cv::Mat image{};
    Stamp stamp{};
    bool lit = false;
    CameraCounters counters{};
  };

  void hand(Item item);
  void take(const Item& item);
  void run() noexcept;
  bool busy();

  PreviewOutput& output_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Item> items_;
  int frames_ = 0;  // in items_ or being drawn
  bool ends_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace tankrig::app
