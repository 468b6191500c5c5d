#include "rig/plan/scan_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/input_error.hpp"
#include "rig/plan/require_positive.hpp"

namespace tankrig {
namespace {

[[noreturn]] void refuse(const char* setting, double found, const std::string& expected) {
  char number[32];
  std::snprintf(number, sizeof number, "%g", found);
  throw InputError(std::string("scan: ") + setting + ": found " + number + ", expected " + expected);
}

void check_settings(const ScanSettings& s) {
  require_positive("scan: sweep_velocity", s.sweep.velocity);
  require_positive("scan: sweep_acceleration", s.sweep.acceleration);
  require_positive("scan: sweep_jerk", s.sweep.jerk);
  require_positive("scan: move_velocity", s.move.velocity);
  require_positive("scan: move_acceleration", s.move.acceleration);
  require_positive("scan: move_jerk", s.move.jerk);
  require_positive("scan: frame_period", s.capture.frame_period);
  require_positive("scan: cycle_hz", s.cycle_hz);
  if (s.sweep.passes < 1) refuse("passes", s.sweep.passes, "at least 1");
  if (s.capture.dark_frames < 0) refuse("dark_frames", s.capture.dark_frames, "0 or more");
  if (!(s.move.settle >= 0)) refuse("settle", s.move.settle, "0 or more seconds");
  if (!(s.sweep.lead_in >= 0)) refuse("sweep_lead_in", s.sweep.lead_in, "0 or more seconds");
  if (!(s.capture.laser_warm_up >= 0)) refuse("laser_warm_up", s.capture.laser_warm_up, "0 or more seconds");
  if (!(std::abs(s.sweep.to - s.sweep.from) > 0)) refuse("sweep_to", s.sweep.to, "an angle other than sweep_from");
  if (s.capture.laser_pairs && !s.capture.laser_switches_per_frame)
    throw InputError(
        "scan: laser_pairs: found true, expected false: the rig does not declare a laser that switches faster than a "
        "frame");
  if (s.capture.laser_pairs && s.capture.laser_warm_up >= 0.25 * s.capture.frame_period)
    refuse("laser_warm_up", s.capture.laser_warm_up, "less than a quarter of the frame period for laser_pairs");
}

/// Smallest value >= 0 that is `t` modulo `period`.
double modulo(double t, double period) {
  const double m = t - period * std::floor(t / period);
  return m >= period * (1 - 1e-9) ? 0 : m;
}

/// Lays segments end to end.
class Builder {
 public:
  Builder(const ScanSettings& settings, const JointVector& now)
      : s_(settings), ramp_(settings.sweep.limits()), q_(now) {}

  double time() const { return segments_.empty() ? 0 : segments_.back().end(); }

  Segment& move(const std::string& name, const JointVector& to) {
    Segment segment;
    segment.motion = JointMove(q_, to, s_.move.limits());
    const double duration = segment.motion.duration();
    return append(name, std::move(segment), duration);
  }

  Segment& hold(const std::string& name, double duration) {
    Segment segment;
    segment.motion = JointMove(q_, q_, s_.move.limits());
    return append(name, std::move(segment), duration);
  }

  void dark_block(const std::string& name, Phase phase) {
    if (s_.capture.dark_frames == 0) return;
    Segment& segment = hold(name, (s_.capture.dark_frames + 1) * s_.capture.frame_period);
    segment.phase = phase;
    segment.record_begin = segment.begin;
    segment.record_end = segment.end();
  }

  /// Elbow from one end of the recorded part to the other, lead-in and ramps outside of it.
  Segment& sweep(const std::string& name, int pass, double first, double last) {
    const double side = last > first ? 1 : -1;
    JointVector to = q_;
    to[kElbow] = last + side * ramp_.distance();
    Segment segment;
    segment.motion = JointMove(q_, to, s_.sweep.limits());
    const double duration = segment.motion.duration();
    Segment& added = append(name, std::move(segment), duration);
    added.phase = Phase::kSweep;
    added.pass = pass;
    added.record_begin = added.begin + lead_time();
    added.record_end = added.record_begin + std::abs(last - first) / s_.sweep.velocity;
    return added;
  }

  /// From rest to the crossing of the recorded part's first angle.
  double lead_time() const { return ramp_.duration() + s_.sweep.lead_in; }
  double lead_distance() const { return ramp_.distance() + s_.sweep.velocity * s_.sweep.lead_in; }

  std::vector<Segment> take() { return std::move(segments_); }

 private:
  Segment& append(const std::string& name, Segment segment, double duration) {
    segment.name = name;
    segment.begin = time();
    segment.duration = duration;
    segment.record_begin = segment.record_end = segment.begin;
    q_ = segment.motion.to();
    segments_.push_back(std::move(segment));
    return segments_.back();
  }

  const ScanSettings& s_;
  const Ramp ramp_;  // of a sweep
  JointVector q_;
  std::vector<Segment> segments_;
};

/// The elbow angle at rest from which a pass that records from `first` to `last` starts.
double start_angle(const Builder& build, double first, double last) {
  return first - (last > first ? 1 : -1) * build.lead_distance();
}

/// When, modulo the frame period, the crossing of `first` must happen so that frames at whole periods see the elbow at
/// sweep_from + velocity * period * (n + pass / passes).
double crossing_phase(const ScanSettings& s, int pass, bool backwards) {
  const double shift = s.capture.frame_period * pass / s.sweep.passes;
  const double span = std::abs(s.sweep.to - s.sweep.from) / s.sweep.velocity;
  return modulo(backwards ? shift - span : -shift, s.capture.frame_period);
}

}  // namespace

bool ScanPlan::uses_laser() const noexcept {
  return std::any_of(segments_.begin(), segments_.end(), [](const Segment& s) { return s.laser; });
}

std::array<JointLimit, kJoints> ScanPlan::reach() const noexcept {
  JointVector least = at(0).q, largest = least;
  for (const Segment& s : segments_) {
    least = least.cwiseMin(s.motion.to());
    largest = largest.cwiseMax(s.motion.to());
  }
  std::array<JointLimit, kJoints> reach;
  for (int j = 0; j < kJoints; ++j) reach[static_cast<std::size_t>(j)] = {least[j], largest[j]};
  return reach;
}

std::size_t ScanPlan::segment_at(double t) const noexcept {
  std::size_t i = 0;
  while (i + 1 < segments_.size() && t >= segments_[i].end()) ++i;
  return i;
}

MotionPoint ScanPlan::at(double t) const noexcept {
  const Segment& segment = segments_[segment_at(t)];
  return segment.motion.at(t - segment.begin);
}

int ScanPlan::expected_frames(RecordWhen record, double frame_period, int dark_frames) const {
  int frames = 0;
  for (const Segment& s : segments_) {
    if (s.phase == Phase::kMove) continue;
    if (s.phase == Phase::kSweep) {
      if (record != RecordWhen::kDark) frames += static_cast<int>((s.record_end - s.record_begin) / frame_period);
    } else if (record != RecordWhen::kSweep) {
      frames += std::min(dark_frames, static_cast<int>((s.record_end - s.record_begin) / frame_period));
    }
  }
  return frames;
}

ScanPlan make_scan_plan(const ScanSettings& s, const JointVector& now) {
  check_settings(s);
  Builder build(s, now);

  JointVector start = s.posture;
  start[kElbow] = start_angle(build, s.sweep.from, s.sweep.to);
  build.move("move to the sweep's start", start);
  build.hold("settle", s.move.settle);
  build.dark_block("dark block before", Phase::kDarkBefore);

  const auto lit_hold = [&](const std::string& name, double duration) {
    Segment& hold = build.hold(name, duration);
    hold.laser = hold.sweeping = true;
  };
  for (int pass = 0; pass < s.sweep.passes; ++pass) {
    const bool backwards = s.sweep.there_and_back && pass % 2 == 1;
    const double first = backwards ? s.sweep.to : s.sweep.from;
    const double last = backwards ? s.sweep.from : s.sweep.to;
    if (pass > 0) {
      JointVector turn = start;
      turn[kElbow] = start_angle(build, first, last);
      Segment& move = build.move("move to pass " + std::to_string(pass), turn);
      move.laser = move.sweeping = true;
    }
    const double rest = pass == 0 ? s.capture.laser_warm_up : s.move.settle;
    const double crossing = build.time() + rest + build.lead_time();
    lit_hold(pass == 0 ? "laser warm-up" : "settle",
             rest + modulo(crossing_phase(s, pass, backwards) - crossing, s.capture.frame_period));
    Segment& sweep = build.sweep("sweep pass " + std::to_string(pass), pass, first, last);
    sweep.laser = sweep.sweeping = true;
  }

  build.hold("settle", s.move.settle);
  build.dark_block("dark block after", Phase::kDarkAfter);
  build.move("move to park", s.park);
  return ScanPlan(build.take());
}

}  // namespace tankrig
