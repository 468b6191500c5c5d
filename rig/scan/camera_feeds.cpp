#include "rig/scan/camera_feeds.hpp"

#include <algorithm>
#include <cstdio>

namespace tankrig {
namespace {

constexpr double kFirstFrame = 3;     // the longest a camera may take from its start to its first frame [s]
constexpr double kSilentPeriods = 5;  // of a slow camera
constexpr int kFramesPerRound = 4;    // of each camera

}  // namespace

CameraFeeds::CameraFeeds(const std::vector<ScanCamera>& cameras, const ScanSettings& settings, Clock& clock,
                         FrameJoiner& joiner, Triggers& triggers, BeamWatch& beam, CameraFeedEvents tell)
    : settings_(settings), clock_(clock), joiner_(joiner), triggers_(triggers), beam_(beam), tell_(std::move(tell)) {
  for (const ScanCamera& c : cameras) {
    const bool at_angles = c.trigger.mode == TriggerMode::kPosition;
    const int number = joiner_.add_camera(c.camera->info().name, c.record, at_angles);
    beam_.add_camera(c.camera->info().name, c.beam_in_view);
    triggers_.add_camera(number, *c.camera, c.record, c.trigger);
    feeds_.push_back(
        {c.camera, number, c.record, c.time_offset, c.trigger.mode != TriggerMode::kFree, false, {}, false, {}});
  }
}

CameraFeeds::~CameraFeeds() {
  for (const Feed& feed : feeds_) feed.camera->stop();
}

bool CameraFeeds::start_grid_camera() {
  const auto sweeps = [](const Feed& f) { return f.record != RecordWhen::kDark; };
  const auto it = std::find_if(feeds_.begin(), feeds_.end(), sweeps);
  if (it == feeds_.end() || it->triggered) return false;
  start(*it);
  return true;
}

void CameraFeeds::schedule(bool ended) {
  const Duration lead = from_seconds(settings_.camera_lead);
  const Stamp now = clock_.now();
  for (Feed& feed : feeds_) {
    const bool wanted = !ended && joiner_.wanted(feed.number, now - lead, now + lead);
    if (wanted && !feed.running) start(feed);
    if (!wanted && feed.running) {
      tell_.asks();
      ask(feed, [&] { return feed.camera->stop(), true; });
      feed.running = false;
    }
  }
}

void CameraFeeds::start(Feed& feed) {
  joiner_.restarted(feed.number);
  triggers_.restarted(feed.number);
  tell_.asks();
  const Status started = ask(feed, [&] { return feed.camera->start(); });
  feed.running = started.ok();
  feed.news = clock_.now();
  feed.delivers = false;
  if (!started.ok()) failed(feed, started.error());
}

/// What is asked of a camera's driver; one that holds the supervisor up is told of where its heartbeat is late.
template <class Call>
std::invoke_result_t<Call> CameraFeeds::ask(const Feed& feed, Call call) {
  const Stamp before = clock_.now();
  auto answer = call();
  const double took = seconds(clock_.now() - before);
  if (took > settings_.heartbeat_timeout) {
    char line[64];
    std::snprintf(line, sizeof line, ": held the supervisor up for %.0f ms", 1e3 * took);
    held_up_ = "camera " + feed.camera->info().name + line;
  }
  return answer;
}

void CameraFeeds::grab() {
  for (Feed& feed : feeds_)
    if (feed.running) grab(feed);
}

/// A camera that takes longer for a frame than it takes to come must not keep the loop.
void CameraFeeds::grab(Feed& feed) {
  const Stamp begin = clock_.now();
  const auto late = [&] { return seconds(clock_.now() - begin) > settings_.heartbeat_timeout; };
  for (int frames = 0; frames < kFramesPerRound && !late(); ++frames) {
    auto news = ask(feed, [&] { return feed.camera->try_grab(); });
    if (!news.ok()) return failed(feed, news.error());
    if (!news.value()) return;
    feed.news = clock_.now();
    feed.delivers = true;
    Frame& frame = *news.value();
    if (const std::string wrong = feed.stamps.judge(frame, feed.news); !wrong.empty()) return failed(feed, wrong);
    frame.stamp = frame.stamp - feed.time_offset;
    tell_.frame(frame.stamp);
    triggers_.add_frame(feed.number, frame);
    beam_.add(feed.number, frame);
    joiner_.add(feed.number, std::move(frame));
  }
}

void CameraFeeds::check_silence() {
  for (const Feed& feed : feeds_)
    if (feed.running) check_silence(feed);
}

void CameraFeeds::check_silence(const Feed& feed) {
  const auto since = feed.triggered ? triggers_.unanswered_since(feed.number) : std::optional(feed.news);
  const double usual = std::max(settings_.safety.camera_timeout, kSilentPeriods / feed.camera->info().rate_hz);
  const double patience = feed.delivers ? usual : std::max(usual, kFirstFrame);
  if (!since || seconds(clock_.now() - *since) <= patience) return;
  char line[48];
  std::snprintf(line, sizeof line, "no frame for %.1f s", patience);
  failed(feed, line);
}

void CameraFeeds::failed(const Feed& feed, const Error& error) {
  failed(feed, describe(error), error.code == ErrorCode::kInternal);
}

void CameraFeeds::failed(const Feed& feed, const std::string& what, bool thread_died) {
  tell_.failed("camera " + feed.camera->info().name + ": " + what, thread_died);
}

std::map<std::string, std::uint64_t> CameraFeeds::counts() const {
  std::map<std::string, std::uint64_t> out;
  for (const Feed& feed : feeds_) {
    const CameraCounters c = feed.camera->counters();
    if (c.incomplete > 0) out[feed.camera->info().name + ".incomplete"] = c.incomplete;
    if (c.overrun > 0) out[feed.camera->info().name + ".overrun"] = c.overrun;
  }
  return out;
}

}  // namespace tankrig
