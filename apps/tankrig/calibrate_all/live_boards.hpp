// The boards step's pictures, judged as they come: whoever holds the board hears at once whether one counts.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <thread>
#include <utility>
#include <vector>

#include "apps/tankrig/calibrate_all/board_count.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "core/frame_record.hpp"

namespace tankrig::app {

/// Judges in a thread of low priority: whoever records never waits for it.
/// Threads: frame() from one.
class LiveBoards {
 public:
  /// `so_far`: what counts already.
  LiveBoards(BoardTarget target, BoardCount so_far, std::size_t cameras, Progress& progress);
  /// Pictures that came are judged first.
  ~LiveBoards();
  LiveBoards(const LiveBoards&) = delete;
  LiveBoards& operator=(const LiveBoards&) = delete;

  /// Shares `image`, which nobody may write to any more.
  void frame(const FrameRecord& record, const cv::Mat& image);

 private:
  using Moment = std::map<std::string, cv::Mat>;
  void run();
  void judge(int picture, const Moment& moment);

  const BoardTarget target_;
  const std::size_t cameras_;
  Progress& progress_;
  BoardCount count_;  // the thread's
  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<int, Moment> coming_;               // guarded by mutex_, as what follows
  std::vector<std::pair<int, Moment>> whole_;  // of all cameras
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace tankrig::app
