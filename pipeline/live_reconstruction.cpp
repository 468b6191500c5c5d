#include "pipeline/live_reconstruction.hpp"

#include <fmt/core.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "core/thread_priority.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr auto kLastFrames = 250ms;  ///< without a frame, after which none of those on their way is left
constexpr auto kPatience = 60s;      ///< with one method
constexpr auto kLeaving = 10s;       ///< likewise, at the end

/// As it will be read back, but for its images.
Session beginning_of(const fs::path& path) {
  Session session;
  session.path = path;
  session.info = read_session_yaml(path / "session.yaml");
  return session;
}

bool same_recording(const Session& a, const Session& b) {
  return calibration_yaml(a.info) == calibration_yaml(b.info) &&
         std::ranges::equal(a.frames, b.frames, {}, frames_line, frames_line);
}

}  // namespace

std::string in_words(const LiveFigures& f) {
  const auto percent = [](std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
  };
  return fmt::format("{} lines, {} points, {:.0f} % found, {:.1f} % clipped", f.lines, f.points,
                     percent(f.found, f.columns), percent(f.clipped, f.found));
}

/// What the thread and its owner share.
class LiveReconstruction::Work {
 public:
  Work(const fs::path& session, const PipelineParameters& parameters, const LiveOptions& options)
      : parameters_(parameters), options_(options), session_(beginning_of(session)) {}

  void run() noexcept {
    if (options_.now) set_background("live");
    guarded([this] {
      look_at_frames();
      reconstruct();
    });
    const std::lock_guard lock(mutex_);
    ended_ = true;
    news_.notify_all();
  }

  /// `step`; what it throws ends all work here.
  template <class Step>
  void guarded(Step step) noexcept {
    try {
      step();
    } catch (const std::exception& e) {
      give_up(e.what());
    } catch (...) {
      give_up("unknown exception");
    }
  }

  void give_up(const std::string& why) noexcept {
    const std::lock_guard lock(mutex_);
    if (trouble_.empty()) trouble_ = why;
    stop_ = true;
    waiting_.clear();
    session_.unwritten.clear();
    ready_ = {};
    news_.notify_all();
  }

  void add(const FrameRecord& frame, const cv::Mat& image) {
    const FrameRecord record = as_recorded(frame);
    const CalibratedCamera* mono = session_.find_camera(CameraRole::kMono);
    const bool for_detector =
        mono && record.camera == mono->name && (record.laser_on || record.phase == Phase::kDarkBefore);
    std::unique_lock lock(mutex_);
    if (stop_) return;
    session_.frames.push_back(record);
    keep(record, image);
    if (for_detector) queue(lock, record, image);
    news_.notify_all();
  }

  void settle() {
    const std::lock_guard lock(mutex_);
    settled_ = options_.now != nullptr;  // under a virtual clock no time is gained
    news_.notify_all();
  }

  void stop() {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    news_.notify_all();
  }

  LiveFigures figures() const {
    const std::lock_guard lock(mutex_);
    return figures_;
  }
  std::string trouble() const {
    const std::lock_guard lock(mutex_);
    return trouble_;
  }
  std::map<std::string, cv::Mat> pictures() const {
    const std::lock_guard lock(mutex_);
    return session_.unwritten;
  }

  ReadyReport finish(const Session& session, const std::atomic<bool>& stop, const ProgressCallback& progress) {
    std::unique_lock lock(mutex_);
    settled_ = in_a_hurry_ = true;
    tell_ = progress;
    if (progress)
      for (const Score& score : ready_.scores) progress("reconstruct: " + score.method(), 1);
    news_.notify_all();
    std::size_t done = 0;
    auto sign_of_life = std::chrono::steady_clock::now();
    while (!ended_ && !stop) {
      news_.wait_for(lock, 50ms);
      const auto now = std::chrono::steady_clock::now();
      if (std::exchange(done, ready_.scores.size()) != ready_.scores.size()) sign_of_life = now;
      if (now - sign_of_life < kPatience) continue;
      trouble_ = "it does not answer";
      break;
    }
    tell_ = {};
    stop_ = true;
    if (!trouble_.empty() || stop) return {};
    if (!same_recording(session_, session)) {
      trouble_ = "the session holds other frames than it has seen";
      return {};
    }
    return std::move(ready_);
  }

  bool wait_for_end() {
    std::unique_lock lock(mutex_);
    return news_.wait_for(lock, kLeaving, [this] { return ended_; });
  }

 private:
  struct Job {
    FrameRecord frame;
    cv::Mat image;
  };

  void keep(const FrameRecord& record, const cv::Mat& image) {
    if (too_much_) return;
    kept_bytes_ += image.total() * image.elemSize();
    too_much_ = kept_bytes_ > options_.kept_bytes;
    if (too_much_)
      session_.unwritten.clear();
    else
      session_.unwritten[record.file] = image;
  }

  void queue(std::unique_lock<std::mutex>& lock, const FrameRecord& record, const cv::Mat& image) {
    figures_.frames += record.laser_on;
    const auto room = [this] { return waiting_.size() < options_.waiting_frames || stop_; };
    if (!options_.now && !news_.wait_for(lock, kPatience, room)) throw InputError("it does not answer");
    if (stop_) return;
    if (!room()) pass_over_oldest();
    waiting_.push_back({record, image});
  }

  void pass_over_oldest() {
    figures_.passed_over += waiting_.front().frame.laser_on;
    waiting_.pop_front();
  }

  /// Whose lines would be late if the next took as long to find as the last one. The newest stays: by it a detector
  /// that was slow once is found to be fast again.
  void pass_over_late(Stamp now) {
    const Stamp found = now + finding_;
    while (waiting_.size() > 1 && is_late(waiting_.front().frame, found)) pass_over_oldest();
  }

  Stamp now() const { return options_.now ? options_.now() : Stamp{}; }

  bool is_late(const FrameRecord& frame, Stamp when) const {
    return options_.now && frame.laser_on && when - frame.stamp > kLatestLine;
  }

  void look_at_frames() {
    std::optional<LiveDetector> detector;
    if (const CalibratedCamera* mono = session_.find_camera(CameraRole::kMono)) detector.emplace(*mono, parameters_);
    std::unique_lock lock(mutex_);
    const auto something_to_do = [this] { return stop_ || settled_ || !waiting_.empty(); };
    while (true) {
      if (!news_.wait_for(lock, kLastFrames, something_to_do)) {
        lock.unlock();
        if (detector) detector->learn_dark();
        lock.lock();
      }
      news_.wait(lock, something_to_do);
      if (stop_ || waiting_.empty()) return;
      const Stamp begin = now();
      pass_over_late(begin);
      const Job job = std::move(waiting_.front());
      waiting_.pop_front();
      news_.notify_all();
      lock.unlock();
      const std::optional<LiveLine> line = look_at(*detector, job, begin);
      lock.lock();
      if (!line) {
        ++figures_.passed_over;
        continue;
      }
      figures_.lines += line->found > 0;
      figures_.points += line->points.size();
      figures_.columns += line->columns;
      figures_.found += line->found;
      figures_.clipped += line->clipped;
    }
  }

  /// Nothing if it is late.
  std::optional<LiveLine> look_at(LiveDetector& detector, const Job& job, Stamp begin) {
    if (!job.frame.laser_on) return detector.add_dark(job.image), LiveLine{};
    LiveLine line = detector.find_line(job.image, job.frame, session_.laser_plane(job.frame));
    const Stamp found = now();
    finding_ = found - begin;
    if (is_late(job.frame, found)) return {};
    if (options_.line) options_.line(line);
    return line;
  }

  /// Frames that were on their way when the plan had no more to record.
  bool wait_for_last_frames() {
    std::unique_lock lock(mutex_);
    for (std::size_t seen = 0; !in_a_hurry_ && !stop_ && seen != session_.frames.size();) {
      seen = session_.frames.size();
      news_.wait_for(lock, kLastFrames, [&] { return in_a_hurry_ || stop_ || seen != session_.frames.size(); });
    }
    return !stop_ && !too_much_;
  }

  void reconstruct() {
    if (!wait_for_last_frames()) return;
    Session session;
    {
      const std::lock_guard lock(mutex_);
      session = session_;
    }
    const ObjectSurface object = object_of(session, parameters_.thresholds);
    for (const std::string& method : kMethods) {
      if (!has_cameras(session, method)) continue;
      const int threads = threads_now();
      if (threads == 0) return;
      tbb::task_arena arena(threads);
      Score score;
      Pictures pictures;
      arena.execute([&] {
        score = score_reconstruction(
            session, parameters_.thresholds, object,
            reconstruct_session(session, parameters_, method,
                                [this](const std::string& stage, double fraction) { tell(stage, fraction); }));
        pictures = draw_pictures(session, object, score);
      });
      const std::lock_guard lock(mutex_);
      ready_.scores.push_back(std::move(score));
      ready_.pictures.merge(pictures);
      news_.notify_all();
    }
  }

  /// For the next method; 0: none is wanted.
  int threads_now() const {
    const std::lock_guard lock(mutex_);
    if (stop_) return 0;
    return options_.now && !in_a_hurry_ ? 1 : tbb::task_arena::automatic;
  }

  /// Under the lock: once finish() has returned, nobody is told.
  void tell(const std::string& stage, double fraction) {
    const std::lock_guard lock(mutex_);
    if (tell_) tell_(stage, fraction);
  }

  const PipelineParameters parameters_;
  const LiveOptions options_;
  Duration finding_{};  // the last line; the detector's thread's

  mutable std::mutex mutex_;  // guards what follows; the session's path and info do not change
  std::condition_variable news_;
  Session session_;
  std::deque<Job> waiting_;
  std::size_t kept_bytes_ = 0;
  bool too_much_ = false;
  LiveFigures figures_;
  ReadyReport ready_;
  bool settled_ = false, in_a_hurry_ = false, stop_ = false, ended_ = false;
  std::string trouble_;
  ProgressCallback tell_;
};

LiveReconstruction::LiveReconstruction(const fs::path& session, const PipelineParameters& parameters,
                                       const LiveOptions& options)
    : work_(std::make_shared<Work>(session, parameters, options)) {
  try {
    thread_ = std::thread([work = work_] { work->run(); });
  } catch (const std::system_error& e) {
    work_->give_up(std::string("no thread: ") + e.what());
  }
}

LiveReconstruction::~LiveReconstruction() {
  work_->stop();
  if (!thread_.joinable()) return;
  if (work_->wait_for_end())
    thread_.join();
  else
    thread_.detach();
}

void LiveReconstruction::frame(const FrameRecord& record, const cv::Mat& image) noexcept {
  work_->guarded([&] { work_->add(record, image); });
}

void LiveReconstruction::all_recorded() noexcept {
  work_->guarded([&] { work_->settle(); });
}

LiveFigures LiveReconstruction::figures() const { return work_->figures(); }

std::string LiveReconstruction::trouble() const { return work_->trouble(); }

std::map<std::string, cv::Mat> LiveReconstruction::pictures() const { return work_->pictures(); }

ReadyReport LiveReconstruction::finish(const Session& session, const std::atomic<bool>& stop,
                                       const ProgressCallback& progress) {
  if (!thread_.joinable()) return {};
  return work_->finish(session, stop, progress);
}

}  // namespace tankrig
