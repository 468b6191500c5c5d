#include "rig/executive/motion_profile.hpp"

#include <cmath>

namespace tankrig {

TrapezoidProfile::TrapezoidProfile(double distance, double velocity, double acceleration)
    : distance_(distance), velocity_(velocity), acceleration_(acceleration) {
  if (distance <= 0) {
    *this = TrapezoidProfile();
  } else if (velocity * velocity >= distance * acceleration) {
    ramp_ = std::sqrt(distance / acceleration);
    velocity_ = acceleration * ramp_;
  } else {
    ramp_ = velocity / acceleration;
    cruise_ = distance / velocity - ramp_;
  }
}

ProfilePoint TrapezoidProfile::at(double t) const noexcept {
  if (t <= 0) return {0, 0, 0};
  if (t >= duration()) return {distance_, 0, 0};
  if (t < ramp_) return {0.5 * acceleration_ * t * t, acceleration_ * t, acceleration_};
  if (t < ramp_ + cruise_) return {velocity_ * (t - 0.5 * ramp_), velocity_, 0};
  const double left = duration() - t;
  return {distance_ - 0.5 * acceleration_ * left * left, acceleration_ * left, -acceleration_};
}

JointMove::JointMove(const JointVector& from, const JointVector& to, double velocity, double acceleration)
    : from_(from), distance_(to - from) {
  const double longest = distance_.cwiseAbs().maxCoeff();
  if (longest > 0) profile_ = TrapezoidProfile(1.0, velocity / longest, acceleration / longest);
}

MotionPoint JointMove::at(double t) const noexcept {
  const ProfilePoint p = profile_.at(t);
  return {from_ + distance_ * p.position, distance_ * p.velocity, distance_ * p.acceleration};
}

}  // namespace tankrig
