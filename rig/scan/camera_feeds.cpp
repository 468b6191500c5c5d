#include "rig/scan/camera_feeds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

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
    Feed feed{.camera = c.camera, .number = number, .record = c.record, .time_offset = c.time_offset};
    feed.triggered = c.trigger.mode != TriggerMode::kFree;
    feed.before = c.camera->counters();
    feeds_.push_back(std::move(feed));
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
  const Duration lead = from_seconds(settings_.capture.camera_lead);
  const Stamp now = clock_.now();
  for (Feed& feed : feeds_) {
    const bool wanted = !ended && joiner_.wanted(feed.number, now - lead, now + lead);
    if (wanted && !feed.running) start(feed);
    if (!wanted && feed.running) stop(feed, ended);
  }
}

void CameraFeeds::stop(Feed& feed, bool ended) {
  tell_.asks();
  ask(feed, [&] { return feed.camera->stop(), true; });
  feed.running = false;
  feed.unexplained += std::exchange(feed.unexplained_now, 0);
  if (feed.triggered) return;
  const std::uint64_t known = feed.camera->counters().left_out() - feed.known_at_last;
  const std::uint64_t missed =
      joiner_.add_silence(feed.number, *feed.last, from_seconds(1 / feed.camera->info().rate_hz), clock_.now(), known);
  feed.missed += ended ? known : missed;
}

void CameraFeeds::start(Feed& feed) {
  triggers_.restarted(feed.number);
  tell_.asks();
  const Status started = ask(feed, [&] { return feed.camera->start(); });
  feed.running = started.ok();
  feed.news = clock_.now();
  feed.delivers = false;
  feed.last.emplace().stamp = feed.news;
  feed.known_before = feed.known_at_last = feed.camera->counters().left_out();
  feed.skipped = 0;
  if (!started.ok()) failed(feed, started.error());
}

/// What is asked of a camera's driver; one that holds the supervisor up is told of where its heartbeat is late.
template <class Call>
std::invoke_result_t<Call> CameraFeeds::ask(const Feed& feed, Call call) {
  const Stamp before = clock_.now();
  auto answer = call();
  const double took = seconds(clock_.now() - before);
  if (took > settings_.control.heartbeat_timeout)
    held_up_ = fmt::format("camera {}: held the supervisor up for {:.0f} ms", feed.camera->info().name, 1e3 * took);
  return answer;
}

void CameraFeeds::grab() {
  for (Feed& feed : feeds_)
    if (feed.running) grab(feed);
}

/// A camera that takes longer for a frame than it takes to come must not keep the loop.
void CameraFeeds::grab(Feed& feed) {
  const Stamp begin = clock_.now();
  const auto late = [&] { return seconds(clock_.now() - begin) > settings_.control.heartbeat_timeout; };
  for (int frames = 0; frames < kFramesPerRound && !late(); ++frames) {
    auto news = ask(feed, [&] { return feed.camera->try_grab(); });
    if (!news.ok()) return failed(feed, news.error());
    if (!news.value()) return;
    feed.news = clock_.now();
    ++feed.taken;
    try {
      if (!hand_on(feed, *news.value())) return;
    } catch (...) {  // of the sink
      ++feed.abandoned;
      throw;
    }
  }
}

/// False: it is stamped by a clock that has jumped.
bool CameraFeeds::hand_on(Feed& feed, Frame& frame) {
  keep_account(feed, frame);
  if (const std::string wrong = feed.stamps.judge(frame, feed.news); !wrong.empty()) {
    ++feed.jumped;
    failed(feed, wrong);
    return false;
  }
  frame.stamp = frame.stamp - feed.time_offset;
  feed.last->stamp = frame.stamp;
  feed.last->exposure = frame.exposure;
  tell_.frame(frame.stamp);
  triggers_.add_frame(feed.number, frame);
  beam_.add(feed.number, frame);
  joiner_.add(feed.number, std::move(frame));
  return true;
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
  failed(feed, fmt::format("no frame for {:.1f} s", patience));
}

void CameraFeeds::failed(const Feed& feed, const Error& error) {
  failed(feed, describe(error), error.code == ErrorCode::kInternal);
}

void CameraFeeds::failed(const Feed& feed, const std::string& what, bool thread_died) {
  tell_.failed("camera " + feed.camera->info().name + ": " + what, thread_died);
}

/// A driver counts what it left out before the next frame is taken, so numbers that are skipped beyond its counts are
/// frames of which nobody knows.
void CameraFeeds::keep_account(Feed& feed, const Frame& frame) {
  const std::uint64_t known = feed.camera->counters().left_out();
  if (feed.delivers && frame.sequence > feed.last->sequence + 1) {
    const std::uint64_t skipped = frame.sequence - feed.last->sequence - 1;
    feed.skipped += skipped;
    tell_.dropped(frame.stamp - feed.time_offset, feed.camera->info().name + ": missing x " + std::to_string(skipped));
  }
  if (feed.skipped > known - feed.known_before)
    feed.unexplained_now = std::max(feed.unexplained_now, feed.skipped - (known - feed.known_before));
  feed.delivers = true;
  feed.known_at_last = known;
  feed.last->sequence = frame.sequence;
}

std::vector<CameraProgress> CameraFeeds::progress() const {
  std::vector<CameraProgress> out;
  for (const Feed& feed : feeds_)
    out.push_back({feed.camera->info().name, feed.taken, feed.camera->counters().left_out() - feed.before.left_out()});
  return out;
}

std::map<std::string, std::uint64_t> CameraFeeds::close_account(std::map<std::string, std::uint64_t>& counts) const {
  std::map<std::string, std::uint64_t> expected;
  for (const auto& [reason, count] : triggers_.counts()) counts[reason] += count;
  for (const Feed& feed : feeds_) {
    const std::string name = feed.camera->info().name;
    const auto add = [&](const char* reason, std::uint64_t count) {
      if (count > 0) counts[name + "." + reason] += count;
    };
    const CameraCounters now = feed.camera->counters();
    add("lost", now.lost - feed.before.lost);
    add("incomplete", now.incomplete - feed.before.incomplete);
    add("overrun", now.overrun - feed.before.overrun);
    // What a free-running camera has on its way when it is stopped is nothing that was to be recorded.
    const std::uint64_t unread = now.unread - feed.before.unread;
    const std::uint64_t missed = feed.triggered ? unread : std::min(unread, feed.missed);
    add("unread", missed);
    add("not_recorded", unread - missed);
    add("clock_unsure", now.clock_unsure - feed.before.clock_unsure);
    add("clock_jump", feed.jumped);
    add("recorder_failed", feed.abandoned);
    const std::uint64_t delivered = now.delivered - feed.before.delivered;
    const std::uint64_t known = now.left_out() - feed.before.left_out();
    // Of a frame that was said to be delivered and did not come, the next one's number tells too.
    const std::uint64_t unexplained =
        std::max(feed.unexplained + feed.unexplained_now, std::max(delivered, feed.taken) - feed.taken);
    if (feed.triggered) {
      const Triggers::Account triggers = triggers_.account(feed.number);
      const std::uint64_t elsewhere = known + feed.jumped + unexplained;
      add("trigger_lost", triggers.lost - std::min(triggers.lost, elsewhere));
      expected[name] = triggers.expected;
    } else {
      const auto silent = counts.find(name + ".silent");
      expected[name] = feed.taken + known + unexplained + (silent == counts.end() ? 0 : silent->second);
    }
  }
  return expected;
}

}  // namespace tankrig
