// How the arm gets from rest to rest: constant velocity between two ramps of bounded acceleration and jerk.
#pragma once

#include "core/arm_model.hpp"

namespace tankrig {

/// Limits of a motion of one coordinate, each > 0.
struct ProfileLimits {
  double velocity = 0, acceleration = 0, jerk = 0;
};

/// Position and its derivatives at one instant of a profile.
struct ProfilePoint {
  double position = 0, velocity = 0, acceleration = 0, jerk = 0;
};

/// From rest to a velocity: jerk up, constant acceleration, jerk down. The middle is left out if the acceleration's
/// limit is not reached. Symmetric about its middle, so it covers half the distance that its final velocity would
/// cover.
class Ramp {
 public:
  Ramp() = default;
  /// To `limits.velocity`.
  explicit Ramp(const ProfileLimits& limits);

  /// 0 <= t <= duration().
  /// RT: safe.
  ProfilePoint at(double t) const noexcept;

  double velocity() const noexcept { return velocity_; }
  double duration() const noexcept { return duration_; }
  double distance() const noexcept { return 0.5 * velocity_ * duration_; }

 private:
  double velocity_ = 0, jerk_ = 0;
  double jerk_time_ = 0, duration_ = 0;  // [s]
};

/// Analytic seven-segment profile over [0, distance], distance >= 0: ramp, cruise, mirrored ramp. If the distance is
/// too short to cruise, the velocity is lower; if it is shorter still, so is the acceleration.
class SCurveProfile {
 public:
  SCurveProfile() = default;
  SCurveProfile(double distance, const ProfileLimits& limits);

  /// Clamped to rest at both ends.
  /// RT: safe.
  ProfilePoint at(double t) const noexcept;

  double duration() const noexcept { return 2 * ramp_.duration() + cruise_; }
  const Ramp& ramp() const noexcept { return ramp_; }

 private:
  double distance_ = 0;
  Ramp ramp_;
  double cruise_ = 0;  // duration [s]
};

/// Joints at one instant of a motion.
struct MotionPoint {
  JointVector q = JointVector::Zero();
  JointVector velocity = JointVector::Zero();
  JointVector acceleration = JointVector::Zero();
};

/// A straight line in joint space: all joints start and stop together; the joint with the longest way sets the pace.
class JointMove {
 public:
  JointMove() = default;
  /// `limits` [rad/s, rad/s^2, rad/s^3] bound the fastest joint.
  JointMove(const JointVector& from, const JointVector& to, const ProfileLimits& limits);

  MotionPoint at(double t) const noexcept;  ///< RT: safe

  const JointVector& from() const noexcept { return from_; }
  JointVector to() const noexcept { return from_ + distance_; }
  double duration() const noexcept { return profile_.duration(); }

 private:
  JointVector from_ = JointVector::Zero();
  JointVector distance_ = JointVector::Zero();
  SCurveProfile profile_;  // of the fraction of the way, [0, 1]
};

}  // namespace tankrig
