#include "rig/plan/motion_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kStep = 5e-3;  // farthest that any point of the arm moves between two samples [m]

/// A capsule in b and what to call it.
struct Body {
  const char* name;
  Capsule shape;
};

std::vector<Body> bodies_at(const ArmModel& arm, const JointVector& q, const Obstacles& o) {
  const auto frames = arm.link_frames(q);
  const Transform& bMe = frames[3];
  const Vector3d elbow = frames[1].translation(), wrist = frames[2].translation();
  const Vector3d tip = bMe * Vector3d(0, 0, o.tool_length);
  std::vector<Body> bodies{{"slew link", {Vector3d::Zero(), frames[0].translation(), o.link_radius}},
                           {"upper arm", {frames[0].translation(), elbow, o.link_radius}},
                           {"elbow", {elbow, wrist, o.link_radius}},
                           {"forearm", {wrist, tip, o.link_radius}}};
  for (const Capsule& c : o.carried) bodies.push_back({"projector", {bMe * c.a, bMe * c.b, c.radius}});
  return bodies;
}

/// Farthest that a point of the arm's skin can be from each joint's axis, whatever the posture [m].
JointVector reaches(const ArmModel& arm, const Obstacles& o) {
  double beyond = o.tool_length + o.link_radius;
  for (const Capsule& c : o.carried) beyond = std::max(beyond, std::max(c.a.norm(), c.b.norm()) + c.radius);
  JointVector reach = JointVector::Zero();
  for (int j = kJawRotate; j >= kSlew; --j) {
    const DhLink& link = arm.dh[static_cast<std::size_t>(j)];
    beyond += std::hypot(link.a, link.d);
    reach[j] = beyond;
  }
  return reach;
}

/// Even, so that the middle of the motion, where it is fastest, is a sample.
int steps_of(const JointMove& motion, const JointVector& reach) {
  const JointVector fastest = motion.at(0.5 * motion.duration()).velocity.cwiseAbs();
  return 2 * std::max(1, static_cast<int>(std::ceil(0.5 * motion.duration() * fastest.dot(reach) / kStep)));
}

struct Nearest {
  double clearance = std::numeric_limits<double>::infinity();
  std::string what;

  void offer(double candidate, const std::string& obstacle, const char* body) {
    if (candidate < clearance) {
      clearance = candidate;
      what = obstacle + ": " + body;
    }
  }
};

Nearest nearest_obstacle(const std::vector<Body>& bodies, const Obstacles& o) {
  static const std::array<const char*, 2> kAxis{"x", "y"};
  Nearest nearest;
  for (const Body& body : bodies) {
    for (const ObstacleBox& box : o.boxes)
      nearest.offer(distance(body.shape.a, body.shape.b, box) - body.shape.radius, box.name, body.name);
    const Vector3d a = o.wMb * body.shape.a, b = o.wMb * body.shape.b;
    nearest.offer(std::min(a.z(), b.z()) - body.shape.radius, "floor", body.name);
    for (int axis = 0; axis < 2; ++axis) {
      const double half = 0.5 * o.tank_size[axis];
      const double low = std::min(a[axis], b[axis]), high = std::max(a[axis], b[axis]);
      nearest.offer(low + half - body.shape.radius, std::string("wall -") + kAxis[axis], body.name);
      nearest.offer(half - high - body.shape.radius, std::string("wall +") + kAxis[axis], body.name);
    }
  }
  return nearest;
}

template <class... Args>
[[noreturn]] void refuse(const Segment& segment, double t, const char* format, Args... args) {
  char detail[200], line[320];
  std::snprintf(detail, sizeof detail, format, args...);
  std::snprintf(line, sizeof line, "motion refused: %s, in \"%s\" at %.2f s", detail, segment.name.c_str(), t);
  throw InputError(line);
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
  for (int j = 0; j < kJoints; ++j) {
    const auto [lower, upper] = allowed[j];
    if (!(p.q[j] >= lower && p.q[j] <= upper))
      refuse(segment, t, "joint %s: found %.4f rad (%.2f deg), expected %.4f to %.4f (%.2f to %.2f deg)",
             kJointNames[j], p.q[j], to_degrees(p.q[j]), lower, upper, to_degrees(lower), to_degrees(upper));
    const double speed = std::abs(p.velocity[j]);
    if (speed > limits.max_velocity)
      refuse(segment, t, "joint %s: found %.4f rad/s (%.2f deg/s), expected at most %.4f (%.2f deg/s)", kJointNames[j],
             speed, to_degrees(speed), limits.max_velocity, to_degrees(limits.max_velocity));
    const double ticks_per_s = speed > 0 ? speed / arm.actuators[j].resolution(p.q[j]) : 0;
    if (ticks_per_s > limits.max_ticks_per_s)
      refuse(segment, t, "joint %s: found %.0f ticks/s (%.4f rad/s), expected at most %.0f", kJointNames[j],
             ticks_per_s, speed, limits.max_ticks_per_s);
  }
}

}  // namespace

double distance(const Vector3d& a, const Vector3d& b, const ObstacleBox& box) {
  const Transform xMb = box.bMx.inverse();
  const Vector3d start = xMb * a, way = xMb * b - start;
  const auto distance_at = [&](double t) {
    const Vector3d outside = ((start + t * way).cwiseAbs() - box.half_size).cwiseMax(0.0);
    return outside.norm();
  };
  // The distance to a convex body is convex along a line: shrink the interval that holds the minimum.
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double t1 = low + (high - low) / 3, t2 = high - (high - low) / 3;
    if (distance_at(t1) <= distance_at(t2))
      high = t2;
    else
      low = t1;
  }
  return distance_at(0.5 * (low + high));
}

MotionCheck check_motion(const ScanPlan& plan, const ArmModel& arm, const Obstacles& obstacles,
                         const MotionLimits& limits) {
  MotionCheck result;
  result.min_clearance = std::numeric_limits<double>::infinity();
  const JointVector reach = reaches(arm, obstacles);
  const auto allowed = allowed_angles(arm, limits, plan.at(0).q);
  for (const Segment& segment : plan.segments()) {
    const int steps = steps_of(segment.motion, reach);
    for (int i = 0; i <= steps; ++i) {
      const double t = segment.motion.duration() * i / steps;
      const MotionPoint p = segment.motion.at(t);
      check_joints(p, arm, allowed, limits, segment, segment.begin + t);
      const Nearest nearest = nearest_obstacle(bodies_at(arm, p.q, obstacles), obstacles);
      if (nearest.clearance < obstacles.margin)
        refuse(segment, segment.begin + t, "%s comes within %.1f mm, expected at least %.1f mm", nearest.what.c_str(),
               nearest.clearance * 1e3, obstacles.margin * 1e3);
      if (nearest.clearance < result.min_clearance)
        result = {nearest.clearance, nearest.what, segment.name, segment.begin + t};
    }
  }
  return result;
}

}  // namespace tankrig
