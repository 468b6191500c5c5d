#include "rig/plan/motion_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kJointStep = 5e-3;  // farthest that any joint moves between two looks at the joints [rad]

[[noreturn]] void refuse(const std::string& detail, const std::string& segment, double t) {
  char when[40];
  std::snprintf(when, sizeof when, "at %.2f s", t);
  throw InputError("motion refused: " + detail + ", in \"" + segment + "\" " + when);
}

template <class... Args>
std::string text(const char* format, Args... args) {
  char buffer[200];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

/// Where every joint may be. One that stands at or a little beyond its stop when the plan begins may start from there.
std::array<JointLimit, kJoints> allowed_angles(const ArmModel& arm, const MotionLimits& limits,
                                               const JointVector& start) {
  std::array<JointLimit, kJoints> allowed;
  for (int j = 0; j < kJoints; ++j) {
    const JointLimit& stops = arm.limits[j];
    const double lower = stops.lower + limits.angle_margin, upper = stops.upper - limits.angle_margin;
    allowed[j] = {std::min(lower, std::max(start[j], stops.lower - limits.stop_margin)),
                  std::max(upper, std::min(start[j], stops.upper + limits.stop_margin))};
  }
  return allowed;
}

void check_joints(const MotionPoint& p, const ArmModel& arm, const std::array<JointLimit, kJoints>& allowed,
                  const MotionLimits& limits, const Segment& segment, double t) {
  const auto refuse_joint = [&](int j, const std::string& found) {
    refuse(std::string("joint ") + kJointNames[j] + ": found " + found, segment.name, segment.begin + t);
  };
  for (int j = 0; j < kJoints; ++j) {
    const auto [lower, upper] = allowed[j];
    if (!(p.q[j] >= lower && p.q[j] <= upper))
      refuse_joint(j, text("%.4f rad (%.2f deg), expected %.4f to %.4f (%.2f to %.2f deg)", p.q[j], to_degrees(p.q[j]),
                           lower, upper, to_degrees(lower), to_degrees(upper)));
    const double speed = std::abs(p.velocity[j]);
    if (speed > limits.max_velocity)
      refuse_joint(j, text("%.4f rad/s (%.2f deg/s), expected at most %.4f (%.2f deg/s)", speed, to_degrees(speed),
                           limits.max_velocity, to_degrees(limits.max_velocity)));
    const double ticks_per_s = speed > 0 ? speed / arm.actuators[j].resolution(p.q[j]) : 0;
    if (ticks_per_s > limits.max_ticks_per_s)
      refuse_joint(
          j, text("%.0f ticks/s (%.4f rad/s), expected at most %.0f", ticks_per_s, speed, limits.max_ticks_per_s));
  }
}

/// All joints are fastest in the middle of a segment.
JointVector fastest(const JointMove& motion) { return motion.at(0.5 * motion.duration()).velocity.cwiseAbs(); }

/// Brings `nearest_of` up to date with one segment.
void look_at(const Segment& segment, const Clearance& clearance, MotionCheck& check) {
  const JointVector velocity = fastest(segment.motion);
  const double end = segment.motion.duration();
  for (std::size_t pair = 0; pair < clearance.pairs(); ++pair) {
    Approach& nearest = check.nearest_of[static_cast<std::size_t>(clearance.kind(pair))];
    const double speed = clearance.closing_speed(pair, velocity);
    for (double t = 0; true;) {
      const JointVector q = segment.motion.at(t).q;
      const double found = clearance.at(pair, q);
      if (found < nearest.clearance) nearest = {found, clearance.name(pair), segment.name, segment.begin + t, q};
      if (speed == 0 || t >= end) break;
      t = std::min(end, t + (found - nearest.clearance + kClearanceAccuracy) / speed);
    }
  }
}

}  // namespace

const Approach& MotionCheck::nearest() const {
  return *std::min_element(nearest_of.begin(), nearest_of.end(),
                           [](const Approach& a, const Approach& b) { return a.clearance < b.clearance; });
}

MotionCheck check_motion(const ScanPlan& plan, const ArmModel& arm, const Obstacles& obstacles,
                         const MotionLimits& limits) {
  MotionCheck result;
  const Clearance clearance(arm, obstacles);
  const auto allowed = allowed_angles(arm, limits, plan.at(0).q);
  for (const Segment& segment : plan.segments()) {
    const double duration = segment.motion.duration();
    // Even, so that the middle of the motion, where it is fastest, is looked at.
    const int steps = 2 * static_cast<int>(std::ceil(0.5 * duration * fastest(segment.motion).maxCoeff() / kJointStep));
    for (int i = 0; i <= steps; ++i) {
      const double t = steps > 0 ? duration * i / steps : 0;
      check_joints(segment.motion.at(t), arm, allowed, limits, segment, t);
    }
    look_at(segment, clearance, result);
    if (const Approach& a = result.nearest(); a.clearance < obstacles.margin)
      refuse(a.pair +
                 text(" comes within %.1f mm, expected at least %.1f mm", 1e3 * a.clearance, 1e3 * obstacles.margin) +
                 ", at " + posture_text(a.q),
             a.segment, a.when);
  }
  return result;
}

std::string posture_text(const JointVector& q) {
  std::string out;
  for (int j = kSlew; j <= kJawRotate; ++j)
    out += text("%s%s %.1f", out.empty() ? "" : ", ", kJointNames[j], to_degrees(q[j]));
  return out + " deg";
}

}  // namespace tankrig
