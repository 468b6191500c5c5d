// How the arm gets from rest to rest: constant velocity between two ramps of constant acceleration.
#pragma once

#include "core/arm_model.hpp"

namespace tankrig {

/// Position, velocity and acceleration of a profile at one instant.
struct ProfilePoint {
  double position = 0, velocity = 0, acceleration = 0;
};

/// Analytic trapezoid over [0, distance], distance >= 0; a triangle where the cruise velocity is not reached.
class TrapezoidProfile {
 public:
  TrapezoidProfile() = default;
  /// `velocity` and `acceleration` > 0.
  TrapezoidProfile(double distance, double velocity, double acceleration);

  /// Clamped to rest at both ends.  RT: safe.
  ProfilePoint at(double t) const noexcept;

  double duration() const noexcept { return 2 * ramp_ + cruise_; }
  double ramp_duration() const noexcept { return ramp_; }
  double ramp_distance() const noexcept { return 0.5 * acceleration_ * ramp_ * ramp_; }

 private:
  double distance_ = 0, velocity_ = 0, acceleration_ = 0;
  double ramp_ = 0, cruise_ = 0;  // durations [s]
};

/// Joints at one instant of a motion.
struct MotionPoint {
  JointVector q = JointVector::Zero();
  JointVector velocity = JointVector::Zero();
  JointVector acceleration = JointVector::Zero();
};

/// A straight line in joint space: all joints start and stop together, the one with the longest way sets the pace.
class JointMove {
 public:
  JointMove() = default;
  /// `velocity` [rad/s] and `acceleration` [rad/s^2] bound the fastest joint.
  JointMove(const JointVector& from, const JointVector& to, double velocity, double acceleration);

  MotionPoint at(double t) const noexcept;  ///< RT: safe

  const JointVector& from() const noexcept { return from_; }
  JointVector to() const noexcept { return from_ + distance_; }
  double duration() const noexcept { return profile_.duration(); }

 private:
  JointVector from_ = JointVector::Zero();
  JointVector distance_ = JointVector::Zero();
  TrapezoidProfile profile_;  // of the fraction of the way, [0, 1]
};

}  // namespace tankrig
