// A step's pictures, judged as they come. The feed shows each at once; the terminal tells of faults, of a camera that has enough, and in
// the end of how many count.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/tankrig/calibrate_all/judged_pictures.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "core/frame_record.hpp"

namespace tankrig::app {

struct RecordedPicture {
  FrameRecord record;
  cv::Mat image;  ///< nobody writes to it
};
/// By camera.
using Moment = std::map<std::string, RecordedPicture>;

/// How a step's pictures are judged.
struct PictureJudge {
  std::size_t cameras = 1;  ///< of which a moment has pictures
  /// The moment that a picture belongs to; nothing: it is not looked at. Called for all of them, in their order, by whoever records.
  std::function<std::optional<int>(const FrameRecord&)> moment_of;
  /// Nothing: there is nothing to say of it. Called for one after another, in a thread of its own.
  std::function<std::optional<JudgedMoment>(int moment, const Moment& pictures)> judge;
};

/// Judges in a thread of low priority: whoever records never waits for it.
/// Threads: frame() from one.
class LivePictures {
 public:
  LivePictures(PictureJudge judge, Progress& progress);
  /// Pictures that came are judged first; then one sentence says how many count.
  ~LivePictures();
  LivePictures(const LivePictures&) = delete;
  LivePictures& operator=(const LivePictures&) = delete;

  /// Shares `image`, which nobody may write to any more.
  void frame(const FrameRecord& record, const cv::Mat& image);

 private:
  void run();
  void judge(int number, const Moment& moment);

  const PictureJudge judge_;
  Progress& progress_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<int, Moment> coming_;               // guarded by mutex_, as what follows
  std::vector<std::pair<int, Moment>> whole_;  // of all cameras
  bool ends_ = false;
  std::string so_far_;  // of the thread's, while it runs
  std::thread thread_;
};

}  // namespace tankrig::app
