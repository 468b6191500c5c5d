#include "rig/plan/motion_profile.hpp"

#include <cmath>

namespace tankrig {
namespace {

/// The velocity that two ramps, up and down again, reach over `distance`.
double peak_velocity(double distance, const ProfileLimits& limits) {
  const double a = limits.acceleration, jerk_time = a / limits.jerk;
  if (distance >= 2 * a * jerk_time * jerk_time)  // distance = v * (v / a + jerk_time)
    return 0.5 * a * (std::sqrt(jerk_time * jerk_time + 4 * distance / a) - jerk_time);
  const double shorter = std::cbrt(distance / (2 * limits.jerk));  // distance = 2 * jerk * time^3
  return limits.jerk * shorter * shorter;
}

}  // namespace

Ramp::Ramp(const ProfileLimits& limits) : velocity_(limits.velocity), jerk_(limits.jerk) {
  const double to_limit = limits.acceleration / limits.jerk;
  if (velocity_ >= limits.acceleration * to_limit) {
    jerk_time_ = to_limit;
    duration_ = to_limit + velocity_ / limits.acceleration;
  } else {
    jerk_time_ = std::sqrt(velocity_ / jerk_);
    duration_ = 2 * jerk_time_;
  }
}

ProfilePoint Ramp::at(double t) const noexcept {
  if (t < jerk_time_) return {jerk_ * t * t * t / 6, 0.5 * jerk_ * t * t, jerk_ * t, jerk_};
  const double left = duration_ - t;
  if (left < jerk_time_)
    return {distance() - velocity_ * left + jerk_ * left * left * left / 6, velocity_ - 0.5 * jerk_ * left * left,
            jerk_ * left, -jerk_};
  const double acceleration = jerk_ * jerk_time_, since = t - jerk_time_;
  const double velocity = 0.5 * acceleration * jerk_time_;
  return {acceleration * jerk_time_ * jerk_time_ / 6 + velocity * since + 0.5 * acceleration * since * since,
          velocity + acceleration * since, acceleration, 0};
}

SCurveProfile::SCurveProfile(double distance, const ProfileLimits& limits) {
  if (!(distance > 0)) return;
  distance_ = distance;
  ramp_ = Ramp(limits);
  if (distance >= 2 * ramp_.distance())
    cruise_ = distance / limits.velocity - ramp_.duration();
  else
    ramp_ = Ramp({peak_velocity(distance, limits), limits.acceleration, limits.jerk});
}

ProfilePoint SCurveProfile::at(double t) const noexcept {
  if (t <= 0) return {};
  const double left = duration() - t;
  if (left <= 0) return {distance_, 0, 0, 0};
  if (t < ramp_.duration()) return ramp_.at(t);
  if (left > ramp_.duration()) return {ramp_.distance() + ramp_.velocity() * (t - ramp_.duration()), ramp_.velocity()};
  const ProfilePoint mirrored = ramp_.at(left);
  return {distance_ - mirrored.position, mirrored.velocity, -mirrored.acceleration, mirrored.jerk};
}

JointMove::JointMove(const JointVector& from, const JointVector& to, const ProfileLimits& limits)
    : from_(from), distance_(to - from) {
  const double longest = distance_.cwiseAbs().maxCoeff();
  if (longest > 0)
    profile_ = SCurveProfile(1.0, {limits.velocity / longest, limits.acceleration / longest, limits.jerk / longest});
}

MotionPoint JointMove::at(double t) const noexcept {
  const ProfilePoint p = profile_.at(t);
  return {from_ + distance_ * p.position, distance_ * p.velocity, distance_ * p.acceleration};
}

}  // namespace tankrig
