#include "rig/scan/scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/input_error.hpp"
#include "rig/capture/frame_joiner.hpp"
#include "rig/executive/cycle.hpp"
#include "rig/executive/executive.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/plan/plan_csv.hpp"
#include "rig/scan/before_start.hpp"
#include "rig/scan/camera_feeds.hpp"
#include "rig/scan/scan_log.hpp"
#include "session/reading/frame_account.hpp"
#include "session/recording/event_kinds.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kProgressPeriod = 100ms;
constexpr Duration kBoxTold = 1s;         // a box that is enabled at once is not told of
constexpr Duration kBeamSettles = 300ms;  // around a switching: projectors glow, contacts are read back late
constexpr double kCyclesToArm = 2;        // until the safety step has seen the switch

/// No camera waits for more dark pictures than the plan has.
BeamSettings beam_settings(const ScanSettings& settings) {
  BeamSettings beam = settings.safety.beam;
  beam.dark_frames = std::clamp(beam.dark_frames, 1, std::max(settings.capture.dark_frames, 1));
  return beam;
}

class ScanRun {
 public:
  explicit ScanRun(ScanJob& job)
      : job_(job),
        plan_(job.plan),
        settings_(job.settings),
        begin_(job.clock.now()),
        executive_(plan_, settings_, job.arm, job.laser),
        joints_(kJointSamples, from_seconds(settings_.control.max_joint_gap)),
        joiner_(plan_, settings_, joints_, laser_, job.sink),
        triggers_(plan_, settings_, job.clock, job.sink),
        beam_(beam_settings(settings_), settings_.capture.laser_pairs ? Duration{0} : kBeamSettles, laser_, joints_),
        feeds_(job.cameras, settings_, job.clock, joiner_, triggers_, beam_, feed_events()),
        end_(settings_.safety),
        log_(plan_, job.sink),
        cycle_(executive_, job.clock, from_seconds(1.0 / settings_.cycle_hz), settings_.real_time,
               {from_seconds(settings_.control.heartbeat_timeout), from_seconds(settings_.safety.rest_timeout)}) {
    executive_.stop_also_on(job_.stop);
    executive_.set_listener(&triggers_);
    executive_.set_step_watch(job_.step_watch);
    executive_.watch_by(job_.box);
  }

  ScanResult run() {
    try {
      start();
      while (!end_.settled() && !cycle_.given_up()) {
        take_turn();
        supervise();
      }
      end_cycle();
      triggers_.finish();
      joiner_.finish();
      take_stock(status());
      tell_summary();
      return job_.result;
    } catch (const std::exception& e) {
      leave_safe(e.what());
      throw;
    } catch (...) {
      leave_safe("unknown exception");
      throw;
    }
  }

  /// The cycle still uses this run.
  bool left_behind() const { return left_behind_; }

 private:
  /// A camera may take its time to start or to stop; the supervisor is well meanwhile.
  CameraFeedEvents feed_events() {
    return {[this] { executive_.heartbeat(well_at_ = job_.clock.now()); },
            [this](Stamp frame) {
              if (!plan_zero_) start_plan(on_frame_grid(frame));
            },
            [this](Stamp when, const std::string& what) { job_.sink.event(when, event_kind::kDrop, what); },
            [this](const std::string& what, bool thread) { thread ? thread_died(what) : device_failed(what); }};
  }

  void start() {
    if (job_.step_watch) job_.step_watch->begin(from_seconds(settings_.safety.guardian_timeout));
    read_interlock();
    triggers_.begin();
    cycle_.begin();
    take_turn();
    wait_for_box();
    if (!feeds_.start_grid_camera()) start_plan(job_.clock.now() + from_seconds(settings_.capture.frame_period));
    executive_.heartbeat(job_.clock.now());
    executive_.set_armed(plan_.uses_laser());  // last: an edge while anything is missing is lost
  }

  /// It has to see the beats before somebody can reset it.
  void wait_for_box() {
    if (!job_.box || !job_.box->reads_enable()) return;
    const Stamp begin = job_.clock.now();
    for (Stamp tell = begin + kBoxTold; !ended() && !job_.box->enabled(job_.clock.now()); take_turn()) {
      const Duration waited = job_.clock.now() - begin;
      if (waited > job_.box->enable_wait())
        device_failed(fmt::format("watchdog box: not enabled within {:g} s, expected somebody to press its button",
                                  seconds(job_.box->enable_wait())));
      if (job_.clock.now() < tell) continue;
      tell = tell + kProgressPeriod;
      if (job_.progress) job_.progress(progress(0, Phase::kMove, "waiting for the watchdog box: press its button"));
    }
  }

  /// About one period of the cycle, and what it left in the ring.
  void take_turn() {
    if (job_.stop.load(std::memory_order_relaxed)) executive_.request_stop();
    cycle_.turn();
    if (cycle_.hangs()) tell_hang();
    if (hung_ && !end_.ended()) executive_.stop_past_cycle();
    triggers_.turn();
    well_at_ = job_.clock.now();
    CycleRecord record;
    while (executive_.try_pop(record)) consume(record);
    if (ended()) executive_.set_armed(false);
  }

  /// Everything beside the cycle: interlock, cameras, disk, screen. Its heartbeat is as old as the round that gave it,
  /// or as the newest camera it began to start or to stop, so a camera or a disk that holds a round up for longer than
  /// heartbeat_timeout costs the beam in the next cycle.
  void supervise() {
    feeds_.begin_round();
    read_interlock();
    if (plan_zero_) feeds_.schedule(ended());
    feeds_.grab();
    if (const std::string dead = triggers_.collect(); !dead.empty()) thread_died(dead);
    if (!ended()) feeds_.check_silence();
    joiner_.drain();
    executive_.set_beam(beam_.judge());
    if (const auto camera = beam_.repeating()) device_failed(of(*camera, "repeats its picture though the arm moves"));
    if (const auto camera = beam_.blind())
      device_failed(of(*camera, "no dark picture arrived, so it cannot verify the beam"));
    report_progress();
    executive_.heartbeat(well_at_);
  }

  /// Nothing of the plan goes on.
  bool ended() const { return end_.ended() || hung_; }

  /// Laser and arm have been told past it; neither can say what became of it.
  void tell_hang() {
    if (std::exchange(hung_, true)) return;
    tell_what_to_cut({}, {});
    const std::string line = fmt::format("cycle: hangs: no step for {:g} s", settings_.control.heartbeat_timeout);
    device_failed(line);
    job_.sink.event(job_.clock.now(), event_kind::kFault, line + "; laser switched off and arm stopped past it");
  }

  /// What was told stays told until it is confirmed, so that a line that comes and goes is told once.
  void tell_what_to_cut(const EndState& left, const EndState& expected) {
    const EndState before = to_be_cut_;
    to_be_cut_.laser_dark = left.laser_dark || (before.laser_dark && expected.laser_dark);
    to_be_cut_.arm_at_rest = left.arm_at_rest || (before.arm_at_rest && expected.arm_at_rest);
    if (job_.cut && to_be_cut_ != before) job_.cut(to_cut(to_be_cut_));
  }

  /// An open interlock ends a scan even where it opens before the executive is armed; a plan without light goes on.
  void read_interlock() {
    const bool closed = interlock_closed_ = job_.interlock_closed && job_.interlock_closed();
    executive_.set_interlock(closed);
    if (!closed && plan_.uses_laser() && !ended()) device_failed(kInterlockOpen);
  }

  /// The way out by an exception: the sink and the cameras are not asked again, the executive runs until all is safe.
  void leave_safe(const char* why) noexcept {
    executive_.request_stop();
    const Stamp give_up = job_.clock.now() + from_seconds(2 * settings_.safety.rest_timeout);
    while (!end_.settled() && !cycle_.given_up() && job_.clock.now() < give_up) {
      cycle_.turn();
      CycleRecord record;
      while (executive_.try_pop(record)) look_at_the_end(record);
      if (cycle_.hangs()) tell_what_to_cut({}, {});
    }
    end_cycle();
    const EndState& left = job_.result.left = end_.left();
    try {
      triggers_.give_up();
      joiner_.give_up();
      take_stock(std::string("stopped: ") + why);
      job_.sink.event(job_.clock.now(), left.safe() ? event_kind::kStop : event_kind::kFault,
                      why + ("; " + to_string(left)));
    } catch (...) {  // the sink is most likely what failed
    }
  }

  /// Where laser off and arm at rest are confirmed, no step is expected any more; else the guardian goes on from here.
  void end_cycle() noexcept {
    if (job_.step_watch && end_.left().safe()) job_.step_watch->release();
    left_behind_ = !cycle_.end();
  }

  void look_at_the_end(const CycleRecord& record) {
    end_.add(record);
    tell_what_to_cut(end_.left(), end_.expected());
  }

  void consume(const CycleRecord& record) {
    look_at_the_end(record);
    if (record.has_joints) take_joints(record.joints);
    if (record.laser && record.laser->emitting) lit_ += record.stamp - last_.stamp;
    if (record.laser) newest_laser_ = record.laser;
    laser_.add(record);
    beam_.add(record);
    log_.add(record, record.fault == Fault::kHeartbeat ? feeds_.held_up() : failure_);
    max_following_error_ = std::max(max_following_error_, record.following_error);
    last_ = record;
  }

  /// An arm that lost its reference has no angles: neither for frames nor for the session.
  void take_joints(const JointState& state) {
    if (!state.q.allFinite() || !state.velocity.allFinite()) {
      ++joints_without_angles_;
      return;
    }
    joints_.push(state);
    newest_q_ = state.q;
    newest_current_a_ = state.current_a;
    job_.sink.joints(state);
  }

  /// A whole number of frame periods after `frame`, and a period ahead of now.
  Stamp on_frame_grid(Stamp frame) const {
    const double period = settings_.capture.frame_period;
    const double periods = std::max(0.0, seconds(job_.clock.now() - frame) / period);
    return frame + from_seconds((static_cast<double>(static_cast<std::int64_t>(periods)) + 2) * period);
  }

  /// `zero`, or whole frame periods later, so that people see the laser armed for indicator_delay before it shines.
  Stamp indicated(Stamp zero) const {
    const auto lit = first_light(plan_);
    if (!lit) return zero;
    const double delay = settings_.safety.indicator_delay + kCyclesToArm / settings_.cycle_hz;
    const double short_of = delay - *lit - seconds(zero - job_.clock.now());
    const double period = settings_.capture.frame_period;
    return short_of > 0 ? zero + from_seconds(std::ceil(short_of / period) * period) : zero;
  }

  void start_plan(Stamp soonest) {
    const Stamp zero = indicated(soonest);
    plan_zero_ = zero;
    job_.sink.event(zero, event_kind::kPlan, "time 0 of the plan");
    joiner_.start(zero);
    executive_.start(zero);
  }

  void device_failed(const std::string& what) {
    if (failure_.empty()) failure_ = what;
    executive_.request_stop();
  }

  void thread_died(const std::string& what) {
    if (failure_.empty()) failure_ = what;
    executive_.thread_died();
  }

  std::string of(int camera, const char* what) const {
    return "camera " + job_.cameras[static_cast<std::size_t>(camera)].camera->info().name + ": " + what;
  }

  void report_progress() {
    if (!job_.progress || !plan_zero_ || ended() || last_.stamp < next_progress_) return;
    next_progress_ = last_.stamp + kProgressPeriod;
    const Segment& segment = plan_.segments()[last_.segment];
    job_.progress(progress(std::clamp(last_.plan_time / plan_.duration(), 0.0, 1.0), segment.phase, segment.name));
  }

  ScanProgress progress(double fraction, Phase phase, std::string segment) const {
    ScanProgress p;
    p.fraction = fraction;
    p.phase = phase;
    p.segment = std::move(segment);
    p.q = newest_q_;
    p.laser = newest_laser_;
    p.current_a = newest_current_a_;
    p.armed = last_.armed;
    p.interlock_closed = interlock_closed_;
    if (job_.box && job_.box->reads_enable()) p.box_enabled = job_.box->enabled(job_.clock.now());
    p.lit_s = seconds(lit_);
    p.cameras = feeds_.progress();
    p.wake_ups = cycle_.wake_ups();
    p.overruns = cycle_.overruns();
    return p;
  }

  std::string status() const {
    if (last_.state == ExecutiveState::kDone)
      return end_.left().safe() ? "complete" : "stopped: laser and arm not confirmed safe after the plan's end";
    if (last_.state == ExecutiveState::kFault) return "stopped: " + log_.fault();
    return "stopped: " + (failure_.empty() ? "asked for" : failure_);
  }

  Statistics sync_statistics() const {
    Statistics out;
    for (const auto& [name, share] : {std::pair{"p50", 0.5}, std::pair{"p99", 0.99}, std::pair{"max", 1.0}}) {
      out.push_back({std::string("sync.residual_") + name + "_ms", 1e3 * seconds(joiner_.residual(share))});
      out.push_back({std::string("sync.residual_") + name + "_mm", 1e3 * joiner_.residual_on_target(share)});
      out.push_back({std::string("sync.stamp_sigma_") + name + "_ms", 1e3 * seconds(joiner_.stamp_sigma(share))});
    }
    for (const Statistic& s : triggers_.statistics()) out.push_back(s);
    return out;
  }

  void take_stock(const std::string& status) {
    ScanResult& r = job_.result;
    r.status = status;
    r.simulated_s = seconds(job_.clock.now() - begin_);
    r.counts = joiner_.counts();
    for (const auto& [camera, expected] : feeds_.close_account(r.counts))
      r.account[camera] = {expected, unaccounted(r.counts, camera, expected)};
    if (joints_without_angles_ > 0) r.counts["joints.without_angles"] = joints_without_angles_;
    r.counts["cycle.overruns"] = cycle_.overruns();
    r.counts["cycle.records_dropped"] = executive_.records_dropped();
    if (!left_behind_) r.times = cycle_.times(), r.granted = cycle_.granted();
    r.max_following_error = max_following_error_;
    r.worst_residual = joiner_.residual(1);
    r.residual_p99 = joiner_.residual(0.99);
    r.sync = sync_statistics();
    r.left = end_.left();
  }

  void tell_summary() {
    const Stamp now = job_.clock.now();
    if (cycle_.overruns() > 0)
      job_.sink.event(now, event_kind::kOverrun,
                      fmt::format("{} cycles late, {} left out", cycle_.overruns(), cycle_.missed_cycles()));
    for (const auto& [camera, account] : job_.result.account)
      job_.sink.event(now, account.closes() ? event_kind::kSummary : event_kind::kFault,
                      "camera " + camera + ": " + account_line(job_.result.counts, camera, account));
    if (plan_.uses_laser() && settings_.safety.beam.verify) job_.sink.event(now, event_kind::kSummary, beam_.summary());
    log_.summary(now, max_following_error_, job_.result.worst_residual, job_.result.left);
  }

  ScanJob& job_;
  const ScanPlan plan_;  // a copy, as the settings: what the cycle uses may outlive the job
  const ScanSettings settings_;
  Stamp begin_;
  Executive executive_;
  JointHistory joints_;
  LaserTimeline laser_;
  FrameJoiner joiner_;
  Triggers triggers_;
  BeamWatch beam_;
  CameraFeeds feeds_;
  SafeEnd end_;
  ScanLog log_;
  CycleRecord last_;
  std::optional<JointVector> newest_q_;
  std::optional<LaserState> newest_laser_;
  double newest_current_a_ = 0;
  Duration lit_{};
  bool interlock_closed_ = false;
  std::optional<Stamp> plan_zero_;
  Stamp well_at_{};
  std::string failure_;             // why the supervisor wants an end
  EndState to_be_cut_{true, true};  // false: people have been told
  Stamp next_progress_{};
  double max_following_error_ = 0;
  std::uint64_t joints_without_angles_ = 0;
  bool hung_ = false, left_behind_ = false;
  Cycle cycle_;  // last: its thread ends before what it steps is gone
};

}  // namespace

ScanResult run_scan(ScanJob& job) {
  if (job.clock.real_time())
    if (const std::string missing = check_real_time(job.settings.real_time); !missing.empty())
      job.sink.event(job.clock.now(), event_kind::kRealTime, missing);
  if (job.box) check_box_open(job.settings.safety, *job.box, job.clock);
  if (job.plan.uses_laser()) check_laser_ready(job.settings, job.laser, job.interlock_closed && job.interlock_closed());
  check_light(job.plan, job.settings.safety);
  for (const ScanCamera& c : job.cameras)
    if (c.beam_in_view) check_witness(job.plan, job.settings.safety.beam, c.camera->info(), c.record);
  const auto end = [](ScanRun* run) {
    if (!run->left_behind()) delete run;
  };
  const std::unique_ptr<ScanRun, decltype(end)> run(new ScanRun(job), end);
  return run->run();
}

}  // namespace tankrig
