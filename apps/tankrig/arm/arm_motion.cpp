#include "apps/tankrig/arm/arm_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/service.hpp"
#include "apps/tankrig/command_line/start_warning.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/command_line/waiting.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "apps/tankrig/scan/shown_scan.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "rig/executive/cycle.hpp"
#include "rig/plan/operator_plan.hpp"
#include "rig/safety/still_watch.hpp"
#include "rig/scan/before_start.hpp"
#include "rig/scan/scan_log.hpp"
#include "session/recording/event_kinds.hpp"

namespace tankrig::app {
namespace {

using namespace std::chrono_literals;

/// Keeps the newest joints; faults are told at once.
class MotionSink final : public ScanSink {
 public:
  MotionSink(const JointVector& q, Progress& progress) : q_(q), progress_(progress) {}
  void joints(const JointState& state) override { q_ = state.q; }
  void frame(const FrameRecord&, const cv::Mat&) override {}
  void event(Stamp, std::string_view kind, const std::string& text) override {
    if (kind == event_kind::kFault || kind == event_kind::kOverrun) progress_.warn("arm: " + text);
    if (kind == event_kind::kRealTime) progress_.warn("real time " + text);
  }
  const JointVector& q() const { return q_; }

 private:
  JointVector q_;
  Progress& progress_;
};

struct Outcome {
  JointVector from, asked, reached;
  ScanPlan plan;
  MotionCheck check;
  ScanResult result;
};

nlohmann::ordered_json json_of(const Outcome& o, bool moved) {
  nlohmann::ordered_json out;
  out["status"] = moved ? o.result.status : "checked";
  for (int j = 0; j < kJoints; ++j) {
    nlohmann::ordered_json joint{
        {"name", kJointNames[j]}, {"from_deg", to_degrees(o.from[j])}, {"asked_deg", to_degrees(o.asked[j])}};
    if (moved) joint["reached_deg"] = to_degrees(o.reached[j]);
    out["joints"].push_back(joint);
  }
  out["duration_s"] = moved ? o.result.simulated_s : o.plan.duration();
  out["clearance_m"] = o.check.nearest().clearance;
  out["nearest"] = o.check.nearest().pair;
  if (!moved) return out;
  out["max_following_error_deg"] = to_degrees(o.result.max_following_error);
  out["laser_dark"] = o.result.left.laser_dark;
  out["arm_at_rest"] = o.result.left.arm_at_rest;
  return out;
}

void print(const Outcome& o, bool moved) {
  std::printf("%-12s %10s %10s %10s\n", "joint", "from", "asked", moved ? "reached" : "");
  for (int j = 0; j < kJoints; ++j) {
    std::printf("%-12s %6.2f deg %6.2f deg", kJointNames[j], to_degrees(o.from[j]), to_degrees(o.asked[j]));
    if (moved) std::printf(" %6.2f deg", to_degrees(o.reached[j]));
    std::printf("\n");
  }
  std::printf("clearance  %.0f mm, %s\n", 1e3 * o.check.nearest().clearance, o.check.nearest().pair.c_str());
  if (moved)
    std::printf("%s after %.1f s; %s\n", o.result.status.c_str(), o.result.simulated_s,
                to_string(o.result.left).c_str());
  else
    std::printf("duration   %.1f s\n", o.plan.duration());
}

}  // namespace

bool came_to_rest(Backend& backend, Duration timeout, const std::function<bool()>& rest,
                  const std::function<void(bool)>& tell) {
  Arm& arm = backend.arm();
  Clock& clock = backend.clock();
  StillWatch still;
  Stamp heard = clock.now();
  const auto over = [&](bool at_rest) { return tell(at_rest), at_rest; };
  for (const Stamp end = heard + timeout; clock.now() < end;) {
    if (!rest() || clock.now() - heard > SafeEnd::kNewsAge) tell(false);
    clock.sleep_until(clock.now() + arm.exchange_period());
    const auto news = arm.try_read();
    if (!news.ok() || !news.value()) continue;
    heard = news.value()->stamp;
    still.add(*news.value());
    if (still.at_rest()) return over(true);
  }
  return over(false);
}

void make_laser_dark(Backend& backend, const ScanSettings& settings) {
  Laser& laser = backend.laser();
  Clock& clock = backend.clock();
  const Stamp deadline = clock.now() + from_seconds(settings.safety.rest_timeout);
  const Waiting told("the laser to read back dark");
  while (true) {
    const Status off = laser.off();
    const auto state = laser.state();
    if (off.ok() && state.ok() && state.value().dark()) return;
    if (clock.now() >= deadline) {
      const std::string why = !off.ok()     ? describe(off.error())
                              : !state.ok() ? describe(state.error())
                                            : "it reads back on";
      throw InputError("laser: not confirmed off (" + why + "), expected dark before the arm moves: cut its supply");
    }
    clock.sleep_until(clock.now() + std::chrono::milliseconds(10));
  }
}

JointVector homed_posture(Backend& backend, const std::string& rig) {
  const JointVector q = read_posture(backend.arm(), backend.clock(), std::chrono::seconds(2));
  const Status rest = backend.arm().rest();
  if (q.allFinite() && (rest.ok() || rest.error().code != ErrorCode::kNotReady)) return q;
  std::string why = "it does not know its joints yet";
  if (Arm5e* const arm = backend.homed_arm()) {
    if (!arm->why_not_homed().empty()) why = arm->why_not_homed();
    try {
      arm->keep_loss();
    } catch (const InputError& e) {
      why += std::string("; and this could not be saved: ") + e.what();
    }
  }
  throw InputError("arm: not homed: " + why + ": tankrig arm home --rig " + rig);
}

Motion::Motion(Backend& backend, const SafetySettings& safety, Progress& progress)
    : backend_(backend), safety_(safety), progress_(progress) {
  if (Arm5e* const arm = backend.homed_arm()) arm->begin_motion();
}

void Motion::run(ScanJob& job) {
  const auto over = [&] {
    if (!job.result.status.empty()) left_ = job.result.left;
    end();
    if (left_) job.result.left = *left_;
    if (left_) show_end(*left_);
  };
  job.step_watch = backend_.step_watch();
  job.box = backend_.box();
  Clock& clock = backend_.clock();
  ServiceNotice service(clock.now());
  // The supervisor reads the interlock in every round.
  job.interlock_closed = [&service, &clock, read = job.interlock_closed] {
    service.alive(clock.now());
    return read && read();
  };
  try {
    run_scan(job);
  } catch (...) {
    over();
    throw;
  }
  over();
}

EndState Motion::look(bool laser_dark) {
  looked_ = true;
  left_ = EndState{laser_dark, true};
  GuardedOutputs guard(backend_.arm(), backend_.laser(), safety_);
  guard.tell(backend_.step_watch(), backend_.box());
  const auto rest = [&] {
    guard.step({.now = backend_.clock().now()});
    [[maybe_unused]] const Status dark = guard.laser_off();
    const bool taken = guard.arm_stop().ok();
    guard.complete();
    return taken;
  };
  left_->arm_at_rest = came_to_rest(backend_, from_seconds(safety_.rest_timeout), rest, [&](bool at_rest) {
    left_->arm_at_rest = at_rest;
    progress_.cut(to_cut(*left_));
  });
  if (StepWatch* const watch = backend_.step_watch(); watch && left_->safe()) watch->release();
  return *left_;
}

void Motion::end() noexcept {
  if (std::exchange(ended_, true)) return;
  Arm5e* const arm = backend_.homed_arm();
  if (!arm || arm->settings().zero_file.empty() || Cycle::any_left_behind()) return;
  try {
    const bool touched = left_.has_value();
    if (!looked_) look(!touched || left_->laser_dark);
    const bool rests = left_->arm_at_rest;
    if (!touched && rests) left_.reset();
    arm->end_motion(rests);
    if (!rests) progress_.warn("arm: not seen at rest at the end: home it again before the next motion");
  } catch (const std::exception& e) {
    progress_.warn(std::string("arm: home it again before the next motion: ") + e.what());
  }
}

int move_arm(const ArmCommandOptions& options, const TargetFrom& target_from, bool hold_to_run) {
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig));
  if (!options.dry_run) require_commission(rig, options.waived);
  const StopOnSignal stop_on_signal;  // before the devices: it outlives them
  const OwnBackend backend =
      make_backend(rig, {.carrier = options.carrier, .need = {.cameras = false}, .command = "arm motion"});
  make_laser_dark(*backend, rig.scan);
  const JointVector now = homed_posture(*backend, options.rig);

  const ArmTarget target = target_from(rig, now);
  ScanSettings settings = rig.scan;
  settings.move.velocity = target.velocity;
  Outcome outcome{now, target.q, now, make_move_plan(settings, now, target.q, target.name), {}, {}};
  outcome.check = check_plan(rig, outcome.plan);
  if (!options.dry_run) {
    const StartWarning warning(rig, *backend, what_will_happen(outcome.plan), options.yes, progress);
    const RigStops stops(*backend, progress, hold_to_run && !backend->world() && !options.yes);
    if (!stops.key_is_held(backend->clock())) throw StoppedEarly("stopped before anything moved");
    MotionSink sink(now, progress);
    ScanJob job{outcome.plan,
                settings,
                backend->clock(),
                backend->arm(),
                backend->laser(),
                {},
                sink,
                StopOnSignal::requested(),
                [] { return false; },
                [&](const ScanProgress& p) {
                  show_state(rig, p);
                  progress.update("arm: " + p.segment, p.fraction);
                },
                [&](const std::string& what) { progress.cut(what); }};
    Motion(*backend, settings.safety, progress).run(job);
    outcome.result = job.result;
    outcome.reached = sink.q();
    progress.finish_line();
  }
  if (options.json)
    print_json(json_of(outcome, !options.dry_run));
  else
    print(outcome, !options.dry_run);
  if (options.dry_run || outcome.result.complete()) return kOk;
  progress.warn("arm " + outcome.result.status + "; " + to_string(outcome.result.left));
  return StopOnSignal::requested() && outcome.result.left.safe() ? kPartial : kFailure;
}

int arm_jog(const ArmCommandOptions& o) {
  return move_arm(
      o,
      [&o](const RigConfig& rig, const JointVector& now) {
        int joint = 0;
        while (o.joint != kJointNames[joint]) ++joint;
        if (!std::isfinite(o.angle_deg)) throw InputError("angle_deg: found no number, expected one");
        // Slower than the dead zone a joint sticks; the default must move every one of them.
        const double slowest = rig.scan.control.dead_zone[joint];
        const double velocity =
            o.velocity_deg_s ? from_degrees(*o.velocity_deg_s) : std::max(rig.scan.move.velocity, slowest);
        if (velocity < slowest)
          throw InputError(
              fmt::format("--velocity: found {:g} deg/s, expected at least {:.2f}, where the dead zone of {} ends",
                          *o.velocity_deg_s, to_degrees(slowest), kJointNames[joint]));
        ArmTarget target{"move " + o.joint, now, velocity};
        target.q[joint] = (o.relative ? now[joint] : 0) + from_degrees(o.angle_deg);
        return target;
      },
      true);
}

int arm_park(const ArmCommandOptions& o) {
  return move_arm(
      o,
      [&o](const RigConfig& rig, const JointVector&) {
        return ArmTarget{"move to park", rig.scan.park,
                         o.velocity_deg_s ? from_degrees(*o.velocity_deg_s) : rig.scan.move.velocity};
      },
      false);
}

}  // namespace tankrig::app
