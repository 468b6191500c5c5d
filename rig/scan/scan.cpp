#include "rig/scan/scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <type_traits>

#include "core/input_error.hpp"
#include "rig/capture/beam_watch.hpp"
#include "rig/capture/frame_joiner.hpp"
#include "rig/capture/triggers.hpp"
#include "rig/executive/cycle.hpp"
#include "rig/executive/executive.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/plan/plan_csv.hpp"
#include "rig/scan/scan_log.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kJointSamples = 4096;  // kept for frames still to be joined
constexpr Duration kFirstFrameTimeout = 3s;  // of the camera that sets the frame grid
constexpr double kSilentPeriods = 5;         // of a slow camera
constexpr int kFramesPerRound = 4;           // of each camera
constexpr Duration kProgressPeriod = 100ms;
constexpr Duration kBeamSettles = 300ms;  // around a switching: projectors glow, contacts are read back late
constexpr double kCyclesToArm = 2;        // until the safety step has seen the switch
constexpr char kInterlockOpen[] = "laser interlock: found open, expected closed";

/// However a scan is left, its cameras are stopped.
class CamerasStopped {
 public:
  explicit CamerasStopped(ScanJob& job) : job_(job) {}
  CamerasStopped(const CamerasStopped&) = delete;
  CamerasStopped& operator=(const CamerasStopped&) = delete;
  ~CamerasStopped() {
    for (ScanCamera& c : job_.cameras) c.camera->stop();
  }

 private:
  ScanJob& job_;
};

class ScanRun {
 public:
  explicit ScanRun(ScanJob& job)
      : job_(job),
        begin_(job.clock.now()),
        executive_(job.plan, job.settings, job.arm, job.laser),
        joints_(kJointSamples, from_seconds(job.settings.max_joint_gap)),
        joiner_(job.plan, job.settings, joints_, laser_, job.sink),
        triggers_(job.plan, job.settings, job.clock, job.sink),
        beam_(job.settings.safety.beam, job.settings.laser_pairs ? Duration{0} : kBeamSettles, laser_, joints_),
        end_(job.settings.safety),
        log_(job.plan, job.sink),
        cycle_(executive_, job.clock, from_seconds(1.0 / job.settings.cycle_hz), job.settings.real_time) {
    executive_.stop_also_on(job_.stop);
    for (const ScanCamera& c : job_.cameras) beam_.add_camera(c.beam_in_view);
    for (const ScanCamera& c : job_.cameras)
      feeds_.push_back({c.camera,
                        joiner_.add_camera(c.camera->info().name, c.record),
                        c.record,
                        c.time_offset,
                        c.trigger.mode != TriggerMode::kFree,
                        false,
                        {},
                        false});
    executive_.set_listener(&triggers_);
    for (std::size_t i = 0; i < feeds_.size(); ++i)
      triggers_.add_camera(feeds_[i].number, *feeds_[i].camera, feeds_[i].record, job_.cameras[i].trigger);
  }

  ScanResult run() {
    try {
      start();
      while (!end_.settled()) {
        take_turn();
        supervise();
      }
      cycle_.end();
      job_.left = end_.left();
      triggers_.finish();
      joiner_.finish();
      return result();
    } catch (const std::exception& e) {
      leave_safe(e.what());
      throw;
    } catch (...) {
      leave_safe("unknown exception");
      throw;
    }
  }

 private:
  struct Feed {
    Camera* camera;
    int number;
    RecordWhen record;
    Duration time_offset;  // taken off the stamp of every frame
    bool triggered;
    bool running;
    Stamp news;     // it was started, or its newest frame arrived
    bool delivers;  // has done so since it was started
  };

  /// The free-running camera whose frames the passes are interleaved on, if any.
  Feed* grid_camera() {
    const auto sweeps = [](const Feed& f) { return f.record != RecordWhen::kDark; };
    const auto it = std::find_if(feeds_.begin(), feeds_.end(), sweeps);
    return it == feeds_.end() || it->triggered ? nullptr : &*it;
  }

  void start() {
    read_interlock();
    triggers_.begin();
    cycle_.begin();
    take_turn();
    if (Feed* feed = grid_camera())
      start_camera(*feed);
    else
      start_plan(job_.clock.now() + from_seconds(job_.settings.frame_period));
    executive_.heartbeat(job_.clock.now());
    executive_.set_armed(job_.plan.uses_laser());  // last: an edge while anything is missing is lost
  }

  /// About one period of the cycle, and what it left in the ring.
  void take_turn() {
    if (job_.stop.load(std::memory_order_relaxed)) executive_.request_stop();
    cycle_.turn();
    triggers_.turn();
    round_began_ = job_.clock.now();
    CycleRecord record;
    while (executive_.try_pop(record)) consume(record);
    if (end_.ended()) executive_.set_armed(false);
    if (!plan_zero_ && round_began_ - begin_ > kFirstFrameTimeout)
      device_failed("camera: no frame to set the frame grid by");
  }

  /// Everything beside the cycle: interlock, cameras, disk, screen. Its heartbeat is as old as the round that gave it,
  /// so a camera or a disk that holds a round up for longer than heartbeat_timeout costs the beam in the next cycle.
  void supervise() {
    read_interlock();
    if (plan_zero_) schedule_cameras();
    for (Feed& feed : feeds_)
      if (feed.running) grab(feed);
    if (const std::string dead = triggers_.collect(); !dead.empty()) thread_died(dead);
    for (Feed& feed : feeds_)
      if (feed.running) check_silence(feed);
    joiner_.drain();
    executive_.set_beam(beam_.judge());
    report_progress();
    executive_.heartbeat(round_began_);
  }

  /// An open interlock ends a scan even where it opens before the executive is armed; a plan without light goes on.
  void read_interlock() {
    const bool closed = job_.interlock_closed && job_.interlock_closed();
    executive_.set_interlock(closed);
    if (!closed && job_.plan.uses_laser()) device_failed(kInterlockOpen);
  }

  /// The way out by an exception: the sink and the cameras are not asked again, the executive runs until all is safe.
  void leave_safe(const char* why) noexcept {
    executive_.request_stop();
    const Stamp give_up = job_.clock.now() + from_seconds(2 * job_.settings.safety.rest_timeout);
    while (!end_.settled() && job_.clock.now() < give_up) {
      cycle_.turn();
      CycleRecord record;
      while (executive_.try_pop(record)) end_.add(record);
    }
    cycle_.end();
    job_.left = end_.left();
    try {
      job_.sink.event(job_.clock.now(), job_.left.safe() ? "stop" : "fault", why + ("; " + to_string(job_.left)));
    } catch (...) {  // the sink is most likely what failed
    }
  }

  void consume(const CycleRecord& record) {
    end_.add(record);
    if (record.has_joints) {
      joints_.push(record.joints);
      job_.sink.joints(record.joints);
    }
    laser_.add(record);
    beam_.add(record);
    log_.add(record, record.fault == Fault::kHeartbeat ? held_up_ : failure_);
    max_following_error_ = std::max(max_following_error_, record.following_error);
    last_ = record;
  }

  void schedule_cameras() {
    const Duration lead = from_seconds(job_.settings.camera_lead);
    const Stamp now = job_.clock.now();
    for (Feed& feed : feeds_) {
      const bool wanted = !end_.ended() && joiner_.wanted(feed.number, now - lead, now + lead);
      if (wanted && !feed.running) start_camera(feed);
      if (!wanted && feed.running) {
        ask(feed, [&] { return feed.camera->stop(), true; });
        feed.running = false;
      }
    }
  }

  /// A device may take its time to start; the supervisor is well meanwhile.
  void start_camera(Feed& feed) {
    joiner_.restarted(feed.number);
    executive_.heartbeat(job_.clock.now());
    const Status started = ask(feed, [&] { return feed.camera->start(); });
    feed.running = started.ok();
    feed.news = job_.clock.now();
    feed.delivers = false;
    if (!started.ok()) camera_failed(feed, started.error());
  }

  /// What is asked of a camera's driver; one that holds the supervisor up is told of where its heartbeat is late.
  template <class Call>
  std::invoke_result_t<Call> ask(const Feed& feed, Call call) {
    const Stamp before = job_.clock.now();
    auto answer = call();
    const double took = seconds(job_.clock.now() - before);
    if (took > job_.settings.heartbeat_timeout) {
      char line[64];
      std::snprintf(line, sizeof line, ": held the supervisor up for %.0f ms", 1e3 * took);
      held_up_ = "camera " + feed.camera->info().name + line;
    }
    return answer;
  }

  /// A camera that takes longer for a frame than it takes to come must not keep the loop.
  void grab(Feed& feed) {
    const Stamp begin = job_.clock.now();
    const auto late = [&] { return seconds(job_.clock.now() - begin) > job_.settings.heartbeat_timeout; };
    for (int frames = 0; frames < kFramesPerRound && !late(); ++frames) {
      auto news = ask(feed, [&] { return feed.camera->try_grab(); });
      if (!news.ok()) return camera_failed(feed, news.error());
      if (!news.value()) return;
      feed.news = job_.clock.now();
      feed.delivers = true;
      news.value()->stamp = news.value()->stamp - feed.time_offset;
      if (!plan_zero_) start_plan(on_frame_grid(news.value()->stamp));
      triggers_.add_frame(feed.number, *news.value());
      beam_.add(feed.number, *news.value());
      joiner_.add(feed.number, std::move(*news.value()));
    }
  }

  /// A camera that delivers nothing though its driver finds nothing wrong; a triggered one, though it is triggered.
  void check_silence(const Feed& feed) {
    const auto since = feed.triggered ? triggers_.unanswered_since(feed.number) : std::optional(feed.news);
    const double usual = std::max(job_.settings.safety.camera_timeout, kSilentPeriods / feed.camera->info().rate_hz);
    const double patience = feed.delivers ? usual : std::max(usual, seconds(kFirstFrameTimeout));
    if (!since || seconds(job_.clock.now() - *since) <= patience || end_.ended()) return;
    char line[48];
    std::snprintf(line, sizeof line, ": no frame for %.1f s", patience);
    device_failed("camera " + feed.camera->info().name + line);
  }

  /// A whole number of frame periods after `frame`, and a period ahead of now.
  Stamp on_frame_grid(Stamp frame) const {
    const double period = job_.settings.frame_period;
    const double periods = std::max(0.0, seconds(job_.clock.now() - frame) / period);
    return frame + from_seconds((static_cast<double>(static_cast<std::int64_t>(periods)) + 2) * period);
  }

  /// `zero`, or whole frame periods later, so that people see the laser armed for indicator_delay before it shines.
  Stamp indicated(Stamp zero) const {
    const auto lit = first_light(job_.plan);
    if (!lit) return zero;
    const double delay = job_.settings.safety.indicator_delay + kCyclesToArm / job_.settings.cycle_hz;
    const double short_of = delay - *lit - seconds(zero - job_.clock.now());
    const double period = job_.settings.frame_period;
    return short_of > 0 ? zero + from_seconds(std::ceil(short_of / period) * period) : zero;
  }

  void start_plan(Stamp soonest) {
    const Stamp zero = indicated(soonest);
    plan_zero_ = zero;
    job_.sink.event(zero, kPlanZeroEvent, "time 0 of the plan");
    joiner_.start(zero);
    executive_.start(zero);
  }

  void device_failed(const std::string& what) {
    if (failure_.empty()) failure_ = what;
    executive_.request_stop();
  }

  void camera_failed(const Feed& feed, const Error& error) {
    const std::string what = "camera " + feed.camera->info().name + ": " + describe(error);
    if (error.code == ErrorCode::kInternal) return thread_died(what);
    device_failed(what);
  }

  void thread_died(const std::string& what) {
    if (failure_.empty()) failure_ = what;
    executive_.thread_died();
  }

  void report_progress() {
    if (!job_.progress || !plan_zero_ || end_.ended() || last_.stamp < next_progress_) return;
    next_progress_ = last_.stamp + kProgressPeriod;
    const Segment& segment = job_.plan.segments()[last_.segment];
    job_.progress({std::clamp(last_.plan_time / job_.plan.duration(), 0.0, 1.0), segment.phase, segment.name});
  }

  std::string status() const {
    if (last_.state == ExecutiveState::kDone)
      return job_.left.safe() ? "complete" : "stopped: laser and arm not confirmed safe after the plan's end";
    if (last_.state == ExecutiveState::kFault) return "stopped: " + log_.fault();
    return "stopped: " + (failure_.empty() ? "asked for" : failure_);
  }

  Statistics sync_statistics() const {
    Statistics out;
    for (const auto& [name, share] : {std::pair{"p50", 0.5}, std::pair{"p99", 0.99}, std::pair{"max", 1.0}}) {
      out.push_back({std::string("sync.residual_") + name + "_ms", 1e3 * seconds(joiner_.residual(share))});
      out.push_back({std::string("sync.residual_") + name + "_mm", 1e3 * joiner_.residual_on_target(share)});
    }
    for (const Statistic& s : triggers_.statistics()) out.push_back(s);
    return out;
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
    r.counts["cycle.overruns"] = cycle_.overruns();
    r.counts["cycle.records_dropped"] = executive_.records_dropped();
    if (cycle_.overruns() > 0)
      job_.sink.event(
          job_.clock.now(), "overrun",
          std::to_string(cycle_.overruns()) + " cycles late, " + std::to_string(cycle_.missed_cycles()) + " left out");
    r.times = cycle_.times();
    r.granted = cycle_.granted();
    r.max_following_error = max_following_error_;
    r.worst_residual = joiner_.residual(1);
    r.residual_p99 = joiner_.residual(0.99);
    r.sync = sync_statistics();
    for (const auto& [reason, count] : triggers_.counts()) r.counts[reason] += count;
    r.left = job_.left;
    if (job_.plan.uses_laser() && job_.settings.safety.beam.verify)
      job_.sink.event(job_.clock.now(), "summary", beam_.summary());
    log_.summary(job_.clock.now(), r.max_following_error, r.worst_residual, r.left);
    return r;
  }

  ScanJob& job_;
  Stamp begin_;
  Executive executive_;
  JointHistory joints_;
  LaserTimeline laser_;
  FrameJoiner joiner_;
  Triggers triggers_;
  std::vector<Feed> feeds_;
  BeamWatch beam_;
  SafeEnd end_;
  ScanLog log_;
  CycleRecord last_;
  std::optional<Stamp> plan_zero_;
  Stamp round_began_{};
  std::string failure_;  // why the supervisor wants an end
  std::string held_up_;  // what it waited for too long, last
  Stamp next_progress_{};
  double max_following_error_ = 0;
  Cycle cycle_;  // last: its thread ends before what it steps is gone
};

}  // namespace

JointVector read_posture(Arm& arm, Clock& clock, Duration timeout) {
  const Stamp deadline = clock.now() + timeout;
  while (true) {
    const auto news = arm.try_read();
    const bool late = clock.now() >= deadline;
    if (!news.ok() && (late || news.error().code != ErrorCode::kTimeout)) throw InputError(describe(news.error()));
    if (news.ok() && news.value()) return news.value()->q;
    if (late)
      throw InputError("arm: found no joint state, expected one within " + std::to_string(seconds(timeout)) + " s");
    clock.sleep_until(clock.now() + arm.exchange_period());
  }
}

void check_laser_ready(const ScanSettings& settings, const Laser& laser, bool interlock_closed) {
  const double warm_up = seconds(laser.warm_up());
  if (warm_up > settings.laser_warm_up + 1e-9) {
    char line[128];
    std::snprintf(line, sizeof line, "scan: laser_warm_up: found %g s, expected at least the laser's own %g s",
                  settings.laser_warm_up, warm_up);
    throw InputError(line);
  }
  if (!interlock_closed) throw InputError(std::string("scan: ") + kInterlockOpen);
}

ScanResult run_scan(ScanJob& job) {
  if (job.clock.real_time()) check_real_time(job.settings.real_time);
  if (job.plan.uses_laser()) check_laser_ready(job.settings, job.laser, job.interlock_closed && job.interlock_closed());
  check_light(job.plan, job.settings.safety);
  const CamerasStopped guard(job);
  ScanRun run(job);
  return run.run();
}

}  // namespace tankrig
