#include "rig/config/scan_section.hpp"

#include <cmath>
#include <cstdio>

#include "core/model_yaml.hpp"
#include "core/text_files.hpp"
#include "rig/config/limits_section.hpp"
#include "rig/config/real_time_section.hpp"
#include "rig/config/safety_section.hpp"
#include "rig/config/sync_section.hpp"

namespace tankrig {
namespace {

/// Reads keys into values that already have one.
struct Section {
  const ConfigNode& node;
  bool complete;

  void number(const char* key, double& value, ConfigNode::Range range, bool needed = false) const {
    if ((complete && needed) || node.has(key)) value = node.number(key, range);
  }
  void count(const char* key, int& value, ConfigNode::Range range) const { value = node.integer_or(key, value, range); }
  void flag(const char* key, bool& value) const { value = node.flag_or(key, value); }
  void joints(const char* key, JointVector& value) const {
    if (complete || node.has(key)) value = read_joints(node, key);
  }
};

constexpr ConfigNode::Range kAngle{-7, 7}, kVelocity{0.001, 2}, kAcceleration{0.001, 20}, kJerk{0.01, 1000},
    kTime{0, 600}, kTimeout{0.001, 60};

std::string real(double value) { return exact_text(value); }
std::string rounded(double value) {
  char buffer[32];
  return {buffer, static_cast<std::size_t>(std::snprintf(buffer, sizeof buffer, "%.4g", value))};
}

/// What the sweep's speed must keep to: the arm's slowest even motion, and the camera's rate.
void check_sweep_velocity(const ConfigNode& sweep, const ScanSettings& scan) {
  if (scan.sweep_velocity < scan.dead_zone[kElbow])
    sweep.fail("velocity_rad_s", "found '" + real(scan.sweep_velocity) + "', expected at least " +
                                     real(scan.dead_zone[kElbow]) + ": below it the arm sticks");
  const double duration = std::abs(scan.sweep_to - scan.sweep_from) / scan.sweep_velocity;
  if (duration < 2 * scan.frame_period)
    sweep.fail("velocity_rad_s", "found '" + real(scan.sweep_velocity) + "', a sweep of " + rounded(duration) +
                                     " s, expected at least two frame periods of " + rounded(scan.frame_period) + " s");
}

/// Cycles within the feedback timeout: with fewer, a late answer of the arm could not be told from silence.
constexpr double kCyclesPerTimeout = 4;

}  // namespace

void read_scan_section(const ConfigNode& node, bool complete, ScanSettings& scan, bool& read_lux) {
  const Section section{node, complete};
  section.joints("park_rad", scan.park);
  section.joints("posture_rad", scan.posture);
  if (complete || node.has("sweep")) {
    const ConfigNode child = node.child("sweep");
    const Section sweep{child, complete};
    sweep.number("from_rad", scan.sweep_from, kAngle, true);
    sweep.number("to_rad", scan.sweep_to, kAngle, true);
    sweep.number("velocity_rad_s", scan.sweep_velocity, kVelocity, true);
    sweep.number("acceleration_rad_s2", scan.sweep_acceleration, kAcceleration);
    sweep.number("jerk_rad_s3", scan.sweep_jerk, kJerk);
    sweep.number("lead_in_s", scan.sweep_lead_in, kTime);
    sweep.count("passes", scan.passes, {1, 100});
    sweep.flag("there_and_back", scan.there_and_back);
  }
  if (const auto child = node.optional_child("move")) {
    const Section move{*child, complete};
    move.number("velocity_rad_s", scan.move_velocity, kVelocity);
    move.number("acceleration_rad_s2", scan.move_acceleration, kAcceleration);
    move.number("jerk_rad_s3", scan.move_jerk, kJerk);
    move.number("settle_s", scan.settle, kTime);
  }
  section.count("dark_frames", scan.dark_frames, {0, 10000});
  section.number("camera_lead_s", scan.camera_lead, kTime);
  section.flag("laser_pairs", scan.laser_pairs);
  section.number("cycle_hz", scan.cycle_hz, {1, 10000});
  read_real_time_section(node, scan.real_time);
  read_limits_section(node, scan.limits);
  if (const auto child = node.optional_child("safety")) read_safety_section(*child, scan.safety);
  read_sync_section(node, scan.sync);
  if (const auto child = node.optional_child("control")) {
    const Section control{*child, complete};
    control.number("position_gain_per_s", scan.position_gain, {0, 100});
    control.number("learning_rate_per_s2", scan.learning_rate, {0, 100});
    control.number("feed_forward_lead_s", scan.feed_forward_lead, {0, 1});
    if (child->has("dead_zone_rad_s")) {
      scan.dead_zone = read_joints(*child, "dead_zone_rad_s");
      if (scan.dead_zone.minCoeff() < 0 || scan.dead_zone.maxCoeff() > 2)
        child->fail("dead_zone_rad_s", "found " + yaml_of(scan.dead_zone) + ", expected five speeds from 0 to 2");
    }
    control.number("following_error_limit_rad", scan.following_error_limit, {0.0001, 1});
    control.number("feedback_timeout_s", scan.feedback_timeout, kTimeout);
    control.number("heartbeat_timeout_s", scan.heartbeat_timeout, kTimeout);
    control.number("max_joint_gap_s", scan.max_joint_gap, kTimeout);
  }
  section.flag("read_lux", read_lux);
}

void check_scan_section(const ConfigNode& node, const ScanSettings& scan, const ArmModel& arm) {
  const auto check = [&](const ConfigNode& where, const char* key, int joint, double angle) {
    const JointLimit& limit = arm.limits[static_cast<std::size_t>(joint)];
    if (angle >= limit.lower && angle <= limit.upper) return;
    where.fail(key, std::string("found ") + kJointNames[static_cast<std::size_t>(joint)] + " at " + real(angle) +
                        " rad, expected " + real(limit.lower) + " to " + real(limit.upper) + " as in arm.limits_rad");
  };
  for (int i = 0; i < kJoints; ++i) {
    if (node.has("park_rad")) check(node, "park_rad", i, scan.park[i]);
    if (node.has("posture_rad") && i != kElbow) check(node, "posture_rad", i, scan.posture[i]);
  }
  if (const auto sweep = node.optional_child("sweep")) {
    check(*sweep, "from_rad", kElbow, scan.sweep_from);
    check(*sweep, "to_rad", kElbow, scan.sweep_to);
    if (scan.sweep_from == scan.sweep_to)
      sweep->fail("to_rad", "found the same angle as from_rad, expected another one");
    check_sweep_velocity(*sweep, scan);
  } else {
    check_sweep_velocity(node, scan);
  }
  const double slowest_hz = kCyclesPerTimeout / scan.feedback_timeout;
  if (scan.cycle_hz < slowest_hz * (1 - 1e-9))
    node.fail("cycle_hz", "found '" + real(scan.cycle_hz) + "', expected at least " + rounded(slowest_hz) +
                              ", four cycles in control.feedback_timeout_s");
  if (scan.laser_pairs && !scan.laser_switches_per_frame)
    node.fail("laser_pairs", "found true, expected false unless laser.switches_per_frame is true");
}

std::string scan_section_yaml(const ScanSettings& s, bool read_lux) {
  return "  park_rad: " + yaml_of(s.park) + "\n  posture_rad: " + yaml_of(s.posture) +
         "\n  sweep:\n    from_rad: " + real(s.sweep_from) + "\n    to_rad: " + real(s.sweep_to) +
         "\n    velocity_rad_s: " + real(s.sweep_velocity) +
         "\n    acceleration_rad_s2: " + real(s.sweep_acceleration) + "\n    jerk_rad_s3: " + real(s.sweep_jerk) +
         "\n    lead_in_s: " + real(s.sweep_lead_in) + "\n    passes: " + std::to_string(s.passes) +
         "\n    there_and_back: " + yaml_bool(s.there_and_back) +
         "\n  move:\n    velocity_rad_s: " + real(s.move_velocity) +
         "\n    acceleration_rad_s2: " + real(s.move_acceleration) + "\n    jerk_rad_s3: " + real(s.move_jerk) +
         "\n    settle_s: " + real(s.settle) + "\n  dark_frames: " + std::to_string(s.dark_frames) +
         "\n  camera_lead_s: " + real(s.camera_lead) + "\n  laser_pairs: " + yaml_bool(s.laser_pairs) +
         "\n  cycle_hz: " + real(s.cycle_hz) + "\n  control:\n    position_gain_per_s: " + real(s.position_gain) +
         "\n    learning_rate_per_s2: " + real(s.learning_rate) +
         "\n    feed_forward_lead_s: " + real(s.feed_forward_lead) + "\n    dead_zone_rad_s: " + yaml_of(s.dead_zone) +
         "\n    following_error_limit_rad: " + real(s.following_error_limit) +
         "\n    feedback_timeout_s: " + real(s.feedback_timeout) +
         "\n    heartbeat_timeout_s: " + real(s.heartbeat_timeout) + "\n    max_joint_gap_s: " + real(s.max_joint_gap) +
         "\n  read_lux: " + yaml_bool(read_lux) + "\n" + limits_section_yaml(s.limits) +
         real_time_section_yaml(s.real_time) + safety_section_yaml(s.safety) + sync_section_yaml(s.sync);
}

}  // namespace tankrig
