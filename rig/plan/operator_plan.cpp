#include "rig/plan/operator_plan.hpp"

#include <cmath>

#include "rig/plan/require_positive.hpp"

namespace tankrig {
namespace {

/// Appends a stretch without motion.
Segment& hold(std::vector<Segment>& segments, const ScanSettings& s, const JointVector& q, const std::string& name,
              double duration) {
  Segment segment;
  segment.name = name;
  segment.begin = segments.empty() ? 0 : segments.back().end();
  segment.duration = duration;
  segment.motion = JointMove(q, q, s.move.limits());
  segment.record_begin = segment.record_end = segment.begin;
  segments.push_back(std::move(segment));
  return segments.back();
}

Segment way(const ScanSettings& s, const JointVector& from, const JointVector& to, const std::string& name) {
  require_positive("move_velocity", s.move.velocity);
  require_positive("move_acceleration", s.move.acceleration);
  require_positive("move_jerk", s.move.jerk);
  Segment segment;
  segment.name = name;
  segment.motion = JointMove(from, to, s.move.limits());
  segment.duration = segment.motion.duration() + s.move.settle;
  return segment;
}

void record(Segment& segment, Phase phase) {
  segment.phase = phase;
  segment.record_end = segment.end();
}

}  // namespace

ScanPlan make_move_plan(const ScanSettings& s, const JointVector& now, const JointVector& to, const std::string& name) {
  return ScanPlan({way(s, now, to, name)});
}

ScanPlan make_rocking_plan(const ScanSettings& s, const JointVector& now, const JointVector& to, int times) {
  std::vector<Segment> segments;
  for (int i = 0; i < 2 * times; ++i) {
    Segment one = i % 2 == 0 ? way(s, now, to, "to") : way(s, to, now, "fro");
    one.begin = segments.empty() ? 0 : segments.back().end();
    one.record_begin = one.record_end = one.begin;
    segments.push_back(std::move(one));
  }
  return ScanPlan(std::move(segments));
}

ScanPlan make_lit_hold_plan(const ScanSettings& s, const JointVector& now, double lit_s) {
  require_positive("frame_period", s.capture.frame_period);
  require_positive("seconds", lit_s);
  std::vector<Segment> segments;
  if (s.capture.dark_frames > 0)
    record(hold(segments, s, now, "dark frames", (s.capture.dark_frames + 1) * s.capture.frame_period),
           Phase::kDarkBefore);
  Segment& warm_up = hold(segments, s, now, "laser warm-up", s.capture.laser_warm_up + s.capture.frame_period);
  warm_up.laser = warm_up.hold = true;
  Segment& lit = hold(segments, s, now, "laser on", lit_s);
  lit.laser = lit.hold = true;
  record(lit, Phase::kSweep);
  return ScanPlan(std::move(segments));
}

}  // namespace tankrig
