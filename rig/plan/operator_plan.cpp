#include "rig/plan/operator_plan.hpp"

#include <cmath>

#include "core/input_error.hpp"
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

/// Appends a move, then rest for the settings' `settle`.
void go(std::vector<Segment>& segments, const ScanSettings& s, const JointVector& from, const JointVector& to,
        const std::string& name) {
  require_positive("move_velocity", s.move.velocity);
  require_positive("move_acceleration", s.move.acceleration);
  require_positive("move_jerk", s.move.jerk);
  Segment& segment = hold(segments, s, from, name, 0);
  segment.motion = JointMove(from, to, s.move.limits());
  segment.duration = segment.motion.duration() + s.move.settle;
}

void record(Segment& segment, Phase phase) {
  segment.phase = phase;
  segment.record_end = segment.end();
}

}  // namespace

ScanPlan make_move_plan(const ScanSettings& s, const JointVector& now, const JointVector& to, const std::string& name) {
  std::vector<Segment> segments;
  go(segments, s, now, to, name);
  return ScanPlan(std::move(segments));
}

ScanPlan make_rocking_plan(const ScanSettings& s, const JointVector& now, const JointVector& to, int times) {
  std::vector<Segment> segments;
  for (int i = 0; i < times; ++i) {
    go(segments, s, now, to, "to");
    go(segments, s, to, now, "fro");
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

ScanPlan make_postures_plan(const ScanSettings& s, const JointVector& now, const std::vector<JointVector>& postures,
                            double rest_s) {
  require_positive("frame_period", s.capture.frame_period);
  require_positive("dark_frames", s.capture.dark_frames);
  if (postures.empty()) throw InputError("scan: found no posture to take pictures in, expected at least one");
  const std::string name = "pictures in " + std::to_string(postures.size()) + " places";
  std::vector<Segment> segments;
  JointVector q = now;
  for (std::size_t k = 0; k < postures.size(); ++k) {
    if (postures[k] != q) go(segments, s, q, postures[k], name);
    q = postures[k];
    if (rest_s > 0) hold(segments, s, q, name, rest_s);
    Segment& block = hold(segments, s, q, name, (s.capture.dark_frames + 1) * s.capture.frame_period);
    record(block, Phase::kDarkBefore);
    block.pass = static_cast<int>(k);
  }
  go(segments, s, q, now, "move back");
  return ScanPlan(std::move(segments));
}

}  // namespace tankrig
