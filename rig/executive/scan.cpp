#include "rig/executive/scan.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>

#include "core/input_error.hpp"
#include "rig/executive/cycle_grid.hpp"
#include "rig/executive/executive.hpp"
#include "rig/executive/frame_joiner.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kJointSamples = 4096;  // kept for frames still to be joined
constexpr Duration kFirstFrameTimeout = 3s;  // of the camera that sets the frame grid
constexpr Duration kSafeGrace = 300ms;       // cycles recorded after a stop or a fault: the arm coming to rest
constexpr Duration kProgressPeriod = 100ms;

/// However a scan is left: laser off, then arm stopped, then cameras.
class OutputsSafe {
 public:
  explicit OutputsSafe(ScanJob& job) : job_(job) {}
  OutputsSafe(const OutputsSafe&) = delete;
  OutputsSafe& operator=(const OutputsSafe&) = delete;
  ~OutputsSafe() {
    (void)job_.laser.set(false);
    (void)job_.arm.stop();
    for (ScanCamera& c : job_.cameras) c.camera->stop();
  }

 private:
  ScanJob& job_;
};

std::string describe(const Error& error) {
  std::string text = std::string(error.where) + ": " + to_string(error.code);
  if (error.os_errno != 0) text += " (errno " + std::to_string(error.os_errno) + ")";
  return text;
}

std::string describe(const CycleRecord& record, const ScanPlan& plan) {
  std::string text = to_string(record.fault);
  if (record.fault == Fault::kFollowingError) {
    char number[48];
    std::snprintf(number, sizeof number, " of %.4f rad", record.following_error);
    text += std::string(": joint ") + kJointNames[static_cast<std::size_t>(std::max(record.joint, 0))] + number;
  } else if (record.error.where[0] != '\0') {
    text += ": " + describe(record.error);
  }
  return text + " in \"" + plan.segments()[record.segment].name + "\"";
}

class ScanRun {
 public:
  explicit ScanRun(ScanJob& job)
      : job_(job),
        begin_(job.clock.now()),
        grid_(begin_, from_seconds(1.0 / job.settings.cycle_hz)),
        executive_(job.plan, job.settings, job.arm, job.laser),
        joints_(kJointSamples, from_seconds(job.settings.max_joint_gap)),
        joiner_(job.plan, job.settings, joints_, laser_, job.sink) {
    for (const ScanCamera& c : job_.cameras)
      feeds_.push_back({c.camera, joiner_.add_camera(c.camera->info().name, c.record), c.record, false});
  }

  ScanResult run() {
    start();
    while (!finished()) {
      cycle();
      if (plan_zero_) schedule_cameras();
      for (Feed& feed : feeds_)
        if (feed.running) grab(feed);
      joiner_.drain();
      report_progress();
    }
    joiner_.finish();
    return result();
  }

 private:
  struct Feed {
    Camera* camera;
    int number;
    RecordWhen record;
    bool running;
  };

  /// The camera whose frames the passes are interleaved on, if any.
  Feed* grid_camera() {
    const auto sweeps = [](const Feed& f) { return f.record != RecordWhen::kDark; };
    const auto it = std::find_if(feeds_.begin(), feeds_.end(), sweeps);
    return it == feeds_.end() ? nullptr : &*it;
  }

  void start() {
    cycle();
    executive_.set_armed(true);
    if (Feed* feed = grid_camera())
      start_camera(*feed);
    else
      start_plan(job_.clock.now() + from_seconds(job_.settings.frame_period));
  }

  /// One step of the executive at the grid's next point, and what it left in the ring.
  void cycle() {
    job_.clock.sleep_until(grid_.next());
    const Stamp now = job_.clock.now();
    if (job_.stop.load(std::memory_order_relaxed)) executive_.request_stop();
    executive_.heartbeat(now);
    executive_.step(now);
    grid_.advance(job_.clock.now());
    CycleRecord record;
    while (executive_.try_pop(record)) consume(record);
    if (!plan_zero_ && now - begin_ > kFirstFrameTimeout) device_failed("camera: no frame to set the frame grid by");
  }

  void consume(const CycleRecord& record) {
    if (record.has_joints) {
      joints_.push(record.joints);
      job_.sink.joints(record.joints);
    }
    laser_.add(record);
    tell_changes(record);
    max_following_error_ = std::max(max_following_error_, record.following_error);
    last_ = record;
    const bool halted = record.state == ExecutiveState::kFault || record.state == ExecutiveState::kStopped;
    if (halted && !halted_at_) halted_at_ = record.stamp;
  }

  void tell_changes(const CycleRecord& r) {
    const bool running = r.state == ExecutiveState::kRunning;
    if (running && (last_.state != r.state || last_.segment != r.segment))
      job_.sink.event(r.stamp, "phase", job_.plan.segments()[r.segment].name);
    if (r.laser_commanded != last_.laser_commanded) job_.sink.event(r.stamp, "laser", r.laser_commanded ? "on" : "off");
    if (r.laser_emitting != last_.laser_emitting)
      job_.sink.event(r.laser_since, "laser", r.laser_emitting ? "emitting" : "dark");
    if (r.state == ExecutiveState::kFault && last_.state != r.state)
      job_.sink.event(r.stamp, "fault", describe(r, job_.plan));
    if (r.state == ExecutiveState::kStopped && last_.state != r.state)
      job_.sink.event(r.stamp, "stop", failure_.empty() ? "asked for" : failure_);
    if (r.state == ExecutiveState::kDone && last_.state != r.state) job_.sink.event(r.stamp, "phase", "done");
  }

  void schedule_cameras() {
    const Duration lead = from_seconds(job_.settings.camera_lead);
    const Stamp now = job_.clock.now();
    for (Feed& feed : feeds_) {
      const bool wanted = !halted_at_ && joiner_.wanted(feed.number, now - lead, now + lead);
      if (wanted && !feed.running) start_camera(feed);
      if (!wanted && feed.running) {
        feed.camera->stop();
        feed.running = false;
      }
    }
  }

  void start_camera(Feed& feed) {
    joiner_.restarted(feed.number);
    const Status started = feed.camera->start();
    feed.running = started.ok();
    if (!started.ok()) device_failed("camera " + feed.camera->info().name + ": " + describe(started.error()));
  }

  void grab(Feed& feed) {
    while (true) {
      auto news = feed.camera->try_grab();
      if (!news.ok()) {
        device_failed("camera " + feed.camera->info().name + ": " + describe(news.error()));
        return;
      }
      if (!news.value()) return;
      if (!plan_zero_) start_plan(on_frame_grid(news.value()->stamp));
      joiner_.add(feed.number, std::move(*news.value()));
    }
  }

  /// A whole number of frame periods after `frame`, and a period ahead of now.
  Stamp on_frame_grid(Stamp frame) const {
    const double period = job_.settings.frame_period;
    const double periods = std::max(0.0, seconds(job_.clock.now() - frame) / period);
    return frame + from_seconds((static_cast<double>(static_cast<std::int64_t>(periods)) + 2) * period);
  }

  void start_plan(Stamp zero) {
    plan_zero_ = zero;
    joiner_.start(zero);
    executive_.start(zero);
  }

  void device_failed(const std::string& what) {
    if (failure_.empty()) failure_ = what;
    executive_.request_stop();
  }

  bool finished() const {
    if (halted_at_) return last_.stamp - *halted_at_ >= kSafeGrace;
    return last_.state == ExecutiveState::kDone;
  }

  void report_progress() {
    if (!job_.progress || !plan_zero_ || last_.stamp < next_progress_) return;
    next_progress_ = last_.stamp + kProgressPeriod;
    const Segment& segment = job_.plan.segments()[last_.segment];
    job_.progress({std::clamp(last_.plan_time / job_.plan.duration(), 0.0, 1.0), segment.phase, segment.name});
  }

  std::string status() const {
    if (last_.state == ExecutiveState::kDone) return "complete";
    if (last_.state == ExecutiveState::kFault) return "stopped: " + describe(last_, job_.plan);
    return "stopped: " + (failure_.empty() ? "asked for" : failure_);
  }

  ScanResult result() {
    ScanResult r;
    r.status = status();
    r.simulated_s = seconds(job_.clock.now() - begin_);
    r.counts = joiner_.counts();
    for (const Feed& feed : feeds_) {
      const CameraCounters c = feed.camera->counters();
      if (c.incomplete > 0) r.counts[feed.camera->info().name + ".incomplete"] = c.incomplete;
      if (c.overrun > 0) r.counts[feed.camera->info().name + ".overrun"] = c.overrun;
    }
    r.counts["cycle.overruns"] = grid_.overruns();
    r.counts["cycle.records_dropped"] = executive_.records_dropped();
    if (grid_.overruns() > 0)
      job_.sink.event(
          job_.clock.now(), "overrun",
          std::to_string(grid_.overruns()) + " cycles late, " + std::to_string(grid_.missed_cycles()) + " left out");
    r.max_following_error = max_following_error_;
    r.worst_residual = joiner_.worst_residual();
    return r;
  }

  ScanJob& job_;
  Stamp begin_;
  CycleGrid grid_;
  Executive executive_;
  JointHistory joints_;
  LaserTimeline laser_;
  FrameJoiner joiner_;
  std::vector<Feed> feeds_;
  CycleRecord last_;
  std::optional<Stamp> plan_zero_;
  std::optional<Stamp> halted_at_;
  std::string failure_;
  Stamp next_progress_{};
  double max_following_error_ = 0;
};

}  // namespace

JointVector read_posture(Arm& arm, Clock& clock, Duration timeout) {
  const Stamp deadline = clock.now() + timeout;
  while (true) {
    const auto news = arm.try_read();
    if (!news.ok()) throw InputError("scan: " + describe(news.error()));
    if (news.value()) return news.value()->q;
    if (clock.now() >= deadline)
      throw InputError("scan: arm: found no joint state, expected one within " + std::to_string(seconds(timeout)) +
                       " s");
    clock.sleep_until(clock.now() + arm.exchange_period());
  }
}

ScanResult run_scan(ScanJob& job) {
  const double warm_up = seconds(job.laser.warm_up());
  if (warm_up > job.settings.laser_warm_up + 1e-9) {
    char line[128];
    std::snprintf(line, sizeof line, "scan: laser_warm_up: found %g s, expected at least the laser's own %g s",
                  job.settings.laser_warm_up, warm_up);
    throw InputError(line);
  }
  OutputsSafe guard(job);
  ScanRun run(job);
  return run.run();
}

}  // namespace tankrig
