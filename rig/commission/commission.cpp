#include "rig/commission/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/angles.hpp"
#include "rig/capture/beam_view.hpp"
#include "rig/commission/commission_sink.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/plan/operator_plan.hpp"
#include "rig/scan/scan_log.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using Step = CommissionStep;
using Verdict = CommissionVerdict;

constexpr Duration kStill = 1s;                       // the encoders are watched for
constexpr int kStillTicks = 3;                        // they may flicker over
constexpr int kStillReadings = 10;                    // at least
constexpr int kPictures = 5;                          // of each camera, dark and lit
constexpr int kSparePictures = 5;                     // cameras start one after another
constexpr double kRock_rad = 0.1, kMoves_rad = 0.02;  // the elbow, to and fro
constexpr double kSpare_s = 2;                        // of light, after a deed's time
constexpr double kBrief_s = 2;                        // of light, where no deed is waited for
constexpr Duration kContactsApart = 1s;               // of one lid, at most
constexpr Duration kRelayOpens = 2s;                  // by itself, at the latest
constexpr double kRelayLight_s = 5;                   // 2 s, until the watch sees it dark, and to spare
constexpr char kInterlock[] = "interlock", kWentDark[] = "dark after its warm-up",
               kBoxOpen[] = "watchdog box not enabled";

bool says(const std::string& status, const char* words) { return status.find(words) != std::string::npos; }

class Commission {
 public:
  explicit Commission(const CommissionJob& job) : job_(job) {}

  std::vector<CommissionFinding> run(const CommissionFinding& disk) {
    take(disk);
    attempt({Step::kEncoders}, [this] { encoders(); });
    if (!passed(Step::kEncoders)) doubt_ = "the encoders are in doubt";
    if (job_.way && doubt_.empty() && !job_.stop) go();
    attempt({Step::kBeam, Step::kLid}, [this] { beam_and_lid(); });
    attempt({Step::kRelayWatchdog}, [this] { relay_watchdog(); });
    attempt({Step::kEnable}, [this] { enable(); });
    std::sort(found_.begin(), found_.end(), [](const auto& a, const auto& b) { return a.step < b.step; });
    return found_;
  }

 private:
  bool waived(Step step) const { return std::ranges::count(job_.waived, step) != 0; }

  bool is_found(Step step) const {
    return std::ranges::any_of(found_, [&](const CommissionFinding& one) { return one.step == step; });
  }
  bool passed(Step step) const {
    return std::ranges::any_of(
        found_, [&](const CommissionFinding& one) { return one.step == step && one.verdict == Verdict::kPassed; });
  }
  void take(const CommissionFinding& one) {
    if (!is_found(one.step)) found_.push_back(one);
  }
  void pass(Step step, const std::string& measured) { take({step, Verdict::kPassed, measured}); }
  void fail(Step step, const std::string& measured) { take({step, Verdict::kFailed, measured}); }

  /// What is not found when it ends has failed.
  template <class Try>
  void attempt(std::initializer_list<Step> steps, Try try_it) {
    std::string why = "not tried: " + (job_.stop || doubt_.empty() ? "stopped" : doubt_);
    for (const Step step : steps)
      if (waived(step)) take({step, Verdict::kWaived, "not tried"});
    const bool wanted = std::ranges::any_of(steps, [&](Step step) { return !is_found(step); });
    if (wanted && doubt_.empty() && !job_.stop) try {
        if (job_.progress)
          job_.progress(name_of(*std::ranges::find_if(steps, [&](Step s) { return !is_found(s); })), 0);
        try_it();
        why = "not seen";
      } catch (const std::exception& e) {
        why = e.what();
      }
    for (const Step step : steps) fail(step, why);
  }

  template <class IsSo>
  bool until(Duration within, IsSo is_so) {
    for (const Stamp end = job_.clock.now() + within; !is_so();) {
      if (job_.stop || job_.clock.now() >= end) return false;
      job_.clock.sleep_until(job_.clock.now() + 10ms);
    }
    return true;
  }

  void encoders() {
    std::array<std::int32_t, kJoints> least{}, most{};
    int readings = 0;
    JointState newest;
    for (const Stamp end = job_.clock.now() + kStill; job_.clock.now() < end;) {
      job_.clock.sleep_until(job_.clock.now() + job_.arm.exchange_period());
      const auto news = job_.arm.try_read();
      if (!news.ok()) return fail(Step::kEncoders, describe(news.error()));
      if (!news.value()) continue;
      newest = *news.value();
      for (std::size_t j = 0; j < kJoints; ++j) {
        least[j] = readings == 0 ? newest.ticks[j] : std::min(least[j], newest.ticks[j]);
        most[j] = readings == 0 ? newest.ticks[j] : std::max(most[j], newest.ticks[j]);
      }
      ++readings;
    }
    if (readings < kStillReadings)
      return fail(Step::kEncoders, fmt::format("{} readings in 1 s, expected at least {}", readings, kStillReadings));
    const JointLimits& limits = job_.rig.scan.limits;
    int widest = 0;
    for (int j = 0; j < kJoints; ++j) {
      const auto n = static_cast<std::size_t>(j);
      const JointLimit& limit = job_.rig.arm.limits[n];
      const double q = newest.q[j];
      if (!std::isfinite(q) || q < limit.lower - limits.beyond || q > limit.upper + limits.beyond)
        return fail(Step::kEncoders, fmt::format("{} at {:.2f} deg, expected {:.2f} to {:.2f}", kJointNames[n],
                                                 to_degrees(q), to_degrees(limit.lower), to_degrees(limit.upper)));
      const int span = most[n] - least[n];
      if (span > kStillTicks)
        return fail(Step::kEncoders, fmt::format("{} flickers over {} ticks at rest, expected at most {}",
                                                 kJointNames[n], span, kStillTicks));
      widest = std::max(widest, span);
    }
    if (!(std::abs(newest.current_a) <= limits.current.amperes))
      return fail(Step::kEncoders,
                  fmt::format("{:.2f} A at rest, expected at most {:g}", newest.current_a, limits.current.amperes));
    pass(Step::kEncoders,
         fmt::format("{} readings in 1 s, at rest within {} ticks, every joint within its limits", readings, widest));
  }

  void go() {
    std::string why;
    try {
      CommissionSink sink;
      const ScanResult result = motion(*job_.way, job_.rig.scan, {}, sink, [] {});
      if (!result.complete()) why = result.status;
    } catch (const std::exception& e) {
      why = e.what();
    }
    if (!why.empty()) doubt_ = "the arm did not get to where the beam is tried: " + why;
  }

  /// Light with the arm at rest. `round`: called in every turn of the supervisor.
  ScanResult light(double lit_s, int dark_frames, const std::vector<ScanCamera>& cameras, CommissionSink& sink,
                   const std::function<void()>& round) {
    ScanSettings settings = job_.rig.scan;
    settings.capture.laser_pairs = false;
    settings.capture.dark_frames = dark_frames;
    settings.capture.laser_warm_up = std::max(settings.capture.laser_warm_up, seconds(job_.laser.warm_up()));
    const ScanPlan plan = make_lit_hold_plan(settings, job_.posture, lit_s);
    return motion(plan, settings, cameras, sink, round);
  }

  ScanResult motion(const ScanPlan& plan, const ScanSettings& settings, const std::vector<ScanCamera>& cameras,
                    CommissionSink& sink, const std::function<void()>& round) {
    ScanJob job{plan,
                settings,
                job_.clock,
                job_.arm,
                job_.laser,
                cameras,
                sink,
                job_.stop,
                [&] {
                  round();
                  return job_.interlock_closed && job_.interlock_closed();
                },
                [&](const ScanProgress& p) {
                  if (job_.progress) job_.progress(p.segment, p.fraction);
                }};
    doubt_ = "laser off and arm at rest were not confirmed before";
    try {
      job_.run(job);
    } catch (...) {
      if (job.result.status.empty()) doubt_.clear();  // refused, and nothing was touched
      throw;
    }
    if (job.result.left.safe()) doubt_.clear();
    return job.result;
  }

  void beam_and_lid() {
    CommissionSink sink;
    std::vector<ScanCamera> cameras;
    if (!waived(Step::kBeam))
      for (std::size_t i = 0; i < job_.cameras.size(); ++i) {
        const RigCamera& camera = job_.rig.cameras[i];
        const StripeInView in_view = stripe_in_view(job_.rig, camera);
        if (!testifies(job_.rig.scan.safety.beam, camera.name) || !in_view(job_.posture)) continue;
        sink.witnesses[camera.name] = {.to_learn = job_.rig.scan.safety.beam.dark_frames, .enough = kPictures};
        cameras.push_back({job_.cameras[i], RecordWhen::kAll, in_view, camera.trigger, camera.time_offset});
      }
    if (!waived(Step::kBeam) && cameras.empty())
      fail(Step::kBeam,
           "no camera that testifies has the stripe in view, neither where the arm was nor in the middle of the sweep");
    if (!waived(Step::kLid) && !job_.reads_interlock)
      fail(Step::kLid, "this program does not see a wired interlock open: try it by hand, and waive this step");
    const double light_s = commission_light_s(job_);
    if (light_s <= kSpare_s) fail(Step::kLid, "hold_limit_s and maximum_on_s leave no time to open it in the light");
    if (is_found(Step::kBeam) && is_found(Step::kLid)) return;

    const bool opens = !is_found(Step::kLid);
    std::optional<Stamp> asked;
    const auto round = [&] {
      if (!opens || asked || !sink.lit || !sink.beam_seen()) return;
      asked = job_.clock.now();
      job_.ask(Deed::kOpenLid, from_seconds(light_s - kSpare_s));
    };
    const int dark_frames =
        cameras.empty()
            ? 0
            : job_.rig.scan.safety.beam.dark_frames + kPictures + kSparePictures +
                  static_cast<int>(std::ceil(job_.rig.scan.capture.camera_lead / job_.rig.scan.capture.frame_period));
    const ScanResult result = light(opens ? light_s : kBrief_s, dark_frames, cameras, sink, round);
    judge_beam(sink, result);
    if (!opens) return;
    const std::string status = result.status + "; " + to_string(result.left);
    // Where the lid is in the stop's channels too, the box may be heard first; this contact has to be seen all the same.
    const bool noticed =
        says(result.status, kInterlock) ||
        (says(result.status, kBoxOpen) && until(kContactsApart, [&] { return !job_.interlock_closed(); }));
    if (!asked || !noticed || !result.left.laser_dark) {
      fail(Step::kLid, (asked ? "asked to open it: " : "not asked to open it: ") + status);
    } else {
      job_.ask(Deed::kCloseLid, job_.patience);
      if (until(job_.patience, [&] { return job_.interlock_closed(); }))
        pass(Step::kLid,
             fmt::format("opened while lit, contact read back open {:.0f} ms after it was noticed",
                         sink.dark && sink.faulted ? std::max(0.0, 1e3 * seconds(*sink.dark - *sink.faulted)) : 0));
      else
        fail(Step::kLid, "opened, but not closed again");
    }
  }

  void judge_beam(const CommissionSink& sink, const ScanResult& result) {
    int clear = 0, seen = 0;
    for (const auto& [camera, w] : sink.witnesses) {
      if (w.stray > 0 || w.clear < kPictures)
        return fail(Step::kBeam, fmt::format("camera {}: no stripe in {} of {} dark pictures, expected at least {} and "
                                             "never one; {}",
                                             camera, w.clear, w.clear + w.stray, kPictures, result.status));
      if (w.seen < kPictures)
        return fail(Step::kBeam, fmt::format("camera {}: a stripe in {} of {} lit pictures, expected at least {}; {}",
                                             camera, w.seen, w.seen + w.missed, kPictures, result.status));
      clear += w.clear;
      seen += w.seen;
    }
    if (!sink.witnesses.empty())
      pass(Step::kBeam, fmt::format("{} cameras: seen in {} lit pictures, not seen in {} dark ones",
                                    sink.witnesses.size(), seen, clear));
  }

  void relay_watchdog() {
    if (!job_.relay) return fail(Step::kRelayWatchdog, "this laser has no relay whose refreshes can be withheld");
    CommissionSink sink;
    sink.emits = [&] { job_.relay->withhold_refreshes(true); };
    const struct Again {
      RelayProof& relay;
      ~Again() { relay.withhold_refreshes(false); }
    } again{*job_.relay};
    const ScanResult result = light(kRelayLight_s, 0, {}, sink, [] {});
    const auto opened = job_.relay->opened_by_itself();
    if (!opened)
      return fail(Step::kRelayWatchdog,
                  "not read back open by itself when its refreshes stopped: it has no watchdog, or no status_query; " +
                      result.status);
    const std::string measured = fmt::format("open {:.0f} ms after its last refresh", 1e3 * seconds(*opened));
    if (*opened > kRelayOpens || !says(result.status, kWentDark) || !result.left.laser_dark)
      return fail(Step::kRelayWatchdog, fmt::format("{}, expected at most {:g} s; {}; {}", measured,
                                                    seconds(kRelayOpens), result.status, to_string(result.left)));
    pass(Step::kRelayWatchdog, measured);
  }

  void enable() {
    if (!job_.has_enable_input)
      return fail(Step::kEnable,
                  "the rig file names no enable_input of a watchdog box: try the stop by hand, and waive this step");
    CommissionSink sink;
    const ScanPlan plan = commission_motion(job_.rig.scan, job_.rig.arm, job_.posture, job_.patience);
    bool asked = false;
    const ScanResult result = motion(plan, job_.rig.scan, {}, sink, [&] {
      if (asked || !sink.joints_now || std::abs((*sink.joints_now - job_.posture)[kElbow]) < kMoves_rad) return;
      asked = true;
      job_.ask(Deed::kPressStop, job_.patience);
    });
    if (asked) job_.ask(Deed::kReleaseStop, job_.patience);
    if (!asked || !says(result.status, kBoxOpen) || !result.left.arm_at_rest)
      return fail(Step::kEnable, (asked ? "asked to press the stop: " : "the elbow was not seen moving: ") +
                                     result.status + "; " + to_string(result.left));
    pass(Step::kEnable, fmt::format("stop pressed while the elbow moved, box open, arm at rest {:.1f} deg from where "
                                    "it began",
                                    to_degrees(std::abs((*sink.joints_now - job_.posture)[kElbow]))));
  }

  const CommissionJob& job_;
  std::vector<CommissionFinding> found_;
  std::string doubt_;  // why nothing more may move or shine; empty: it may
};

}  // namespace

JointVector commission_posture(const RigConfig& rig, const JointVector& now) {
  for (const RigCamera& camera : rig.cameras)
    if (testifies(rig.scan.safety.beam, camera.name) && stripe_in_view(rig, camera)(now)) return now;
  JointVector middle = rig.scan.posture;
  middle[kElbow] = 0.5 * (rig.scan.sweep.from + rig.scan.sweep.to);
  return middle;
}

ScanPlan commission_motion(const ScanSettings& settings, const ArmModel& arm, const JointVector& posture,
                           Duration patience) {
  const JointLimit& limit = arm.limits[kElbow];
  JointVector to = posture;
  to[kElbow] += posture[kElbow] < 0.5 * (limit.lower + limit.upper) ? kRock_rad : -kRock_rad;
  ScanSettings s = settings;
  s.move.velocity = std::max(s.move.velocity, settings.control.dead_zone[kElbow]);
  const double once = make_rocking_plan(s, posture, to, 1).duration();
  return make_rocking_plan(s, posture, to, static_cast<int>(std::ceil(seconds(patience) / once)));
}

double commission_light_s(const CommissionJob& job) {
  const SafetySettings& safety = job.rig.scan.safety;
  const double warm_up = std::max(job.rig.scan.capture.laser_warm_up, seconds(job.laser.warm_up()));
  return std::min(seconds(job.patience) + kSpare_s,
                  std::min(safety.hold_limit, safety.maximum_on) - warm_up - 2 * job.rig.scan.capture.frame_period);
}

std::vector<CommissionFinding> commission(const CommissionJob& job, const CommissionFinding& disk) {
  return Commission(job).run(disk);
}

}  // namespace tankrig
