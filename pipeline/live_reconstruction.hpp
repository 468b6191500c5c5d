// A scan reconstructed while it is being recorded: what the operator sees during the sweep, and scores that are ready
// when the arm has parked.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/time.hpp"
#include "pipeline/live_detector.hpp"
#include "pipeline/report_session.hpp"

namespace tankrig {

/// The sweep so far.
struct LiveFigures {
  std::uint64_t frames = 0;       ///< with the laser on
  std::uint64_t passed_over = 0;  ///< of those, without a line in time: the detector was too slow for them
  std::uint64_t lines = 0;        ///< of those, with a stripe in them
  std::uint64_t points = 0;
  std::uint64_t columns = 0, found = 0, clipped = 0;  ///< as in LiveLine, of all lines
};

/// "123 lines, 45678 points, 97 % found, 0.2 % clipped"
std::string in_words(const LiveFigures& figures);

/// From a frame's stamp until its line is told, in real time, at most. Who draws its points has the rest of half a
/// second.
inline constexpr Duration kLatestLine = std::chrono::milliseconds{300};

struct LiveOptions {
  /// The time of the frames' stamps, if it passes by itself; from the detector's thread. Then frames that wait for the
  /// detector are passed over, the oldest first, where there are too many of them or their lines would be later than
  /// kLatestLine; a line that is, is not told. Until finish() one thread of low priority does all the work.
  /// None, under a virtual clock: frame() waits for the detector, and the reconstruction for finish().
  std::function<Stamp()> now = {};
  std::size_t waiting_frames = 16;      ///< for the detector
  std::size_t kept_bytes = 1ull << 30;  ///< of pictures, for the reconstruction; with more of them there is none
  /// Each line, in order, as soon as it is found: to grow a cloud. From the detector's thread. What it throws ends the
  /// live reconstruction, not the scan.
  std::function<void(const LiveLine&)> line = {};
};

/// During the sweep our detector looks at each frame. When everything is recorded all methods are reconstructed and
/// scored from the pictures in memory, as they would be from the session: the same functions on the same input.
/// Whatever goes wrong here ends this object's work alone: trouble() tells, and the session has everything.
/// Threads: frame() and all_recorded() from one, the others from any.
class LiveReconstruction {
 public:
  /// `session`: a folder with the session.yaml of a recording that begins.
  LiveReconstruction(const std::filesystem::path& session, const PipelineParameters& parameters,
                     const LiveOptions& options = {});
  /// A thread that does not end within ten seconds is left behind.
  ~LiveReconstruction();
  LiveReconstruction(const LiveReconstruction&) = delete;
  LiveReconstruction& operator=(const LiveReconstruction&) = delete;

  /// A frame as the recorder gets it. Shares `image`, which nobody may write to any more.
  void frame(const FrameRecord& record, const cv::Mat& image) noexcept;
  /// The plan records nothing more: the reconstruction may begin.
  void all_recorded() noexcept;

  LiveFigures figures() const;
  /// Why it does no more; empty while all is well.
  std::string trouble() const;
  /// Every picture so far, by FrameRecord::file; nothing if one is missing.
  std::map<std::string, cv::Mat> pictures() const;

  /// The scores of all methods and their pictures, when they are ready; nothing if there was trouble, a stop, or if `session` is not what was
  /// seen here: then they are made from the session. Once, when the recording is closed.
  ReadyReport finish(const Session& session, const std::atomic<bool>& stop, const ProgressCallback& progress = {});

 private:
  class Work;
  std::shared_ptr<Work> work_;  // the thread's, too
  std::thread thread_;
};

}  // namespace tankrig
