#include "rig/safety/joint_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tankrig {
namespace {

using Limit = JointViolation::Limit;

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr JointLimit kAnywhere{-kUnbounded, kUnbounded};

bool turns_without_end(const JointLimit& limit) noexcept {
  return limit.upper - limit.lower > 2 * std::numbers::pi - 1e-6;
}

}  // namespace

std::string describe(const JointViolation& v) {
  const char* name = kJointNames[static_cast<std::size_t>(v.joint)];
  switch (v.kind) {
    case Limit::kAngle:
      return fmt::format("{} at {:.4f} rad, limit {:.4f}", name, v.value, v.limit);
    case Limit::kRefusal:
      return fmt::format("{} driven on at {:.4f} rad, refused beyond {:.4f}", name, v.value, v.limit);
    case Limit::kVelocity:
      return fmt::format("{} at {:.4f} rad/s, limit {:.4f}", name, v.value, v.limit);
    case Limit::kTicks:
      return fmt::format("{} at {:.0f} ticks/s, limit {:.0f}", name, v.value, v.limit);
    case Limit::kSetPointStep:
      return fmt::format("{} asked to change by {:.4f} rad/s at once, limit {:.4f}", name, v.value, v.limit);
    case Limit::kCurrent:
      return fmt::format("the arm takes {:.2f} A for too long, limit {:.2f}", v.value, v.limit);
    case Limit::kFollowingError:
      break;
  }
  return fmt::format("joint {} of {:.4f} rad, limit {:.4f}", name, v.value, v.limit);
}

JointMonitor::JointMonitor(const JointLimits& limits, double following_error)
    : limits_(limits), following_error_(following_error) {
  set_reach(limits.angles);
}

void JointMonitor::set_reach(const std::array<JointLimit, kJoints>& reach) noexcept {
  for (std::size_t j = 0; j < kJoints; ++j) {
    const JointLimit& angle = limits_.angles[j];
    refused_[j] = kAnywhere;
    if (turns_without_end(angle)) continue;
    refused_[j].lower = std::min(angle.lower + limits_.refusal_margin, reach[j].lower - limits_.beyond);
    refused_[j].upper = std::max(angle.upper - limits_.refusal_margin, reach[j].upper + limits_.beyond);
  }
}

JointMonitor::Answer JointMonitor::check_state(const JointState& state) noexcept {
  if (current_.step(limits_.current, state.stamp, state.current_a))
    return JointViolation{Limit::kCurrent, 0, state.current_a, limits_.current.amperes};
  const Answer speeds = check_speeds(state);
  const Answer angles = check_angles(state.q);
  return angles ? angles : speeds;
}

JointMonitor::Answer JointMonitor::check_angles(const JointVector& q) const noexcept {
  for (int j = 0; j < kJoints; ++j) {
    const JointLimit& angle = limits_.angles[static_cast<std::size_t>(j)];
    if (turns_without_end(angle)) continue;
    if (q[j] > angle.upper + limits_.beyond) return JointViolation{Limit::kAngle, j, q[j], angle.upper};
    if (q[j] < angle.lower - limits_.beyond) return JointViolation{Limit::kAngle, j, q[j], angle.lower};
  }
  return {};
}

/// The newest of the past that is a window old.
const JointState* JointMonitor::window_ago(Stamp now) const noexcept {
  for (std::int64_t n = count_ - 1; n >= std::max<std::int64_t>(0, count_ - kPast); --n) {
    const JointState& past = past_[static_cast<std::size_t>(n % kPast)];
    if (now - past.stamp >= limits_.velocity_window) return &past;
  }
  return nullptr;
}

JointMonitor::Answer JointMonitor::check_speeds(const JointState& state) noexcept {
  Answer answer;
  if (const JointState* past = window_ago(state.stamp)) {
    for (int j = 0; j < kJoints && !answer; ++j) {
      const auto row = static_cast<std::size_t>(j);
      const double t = seconds((state.stamp - state.age[row]) - (past->stamp - past->age[row]));
      if (t <= 0) continue;  // not read since
      const double speed = std::abs(state.q[j] - past->q[j]) / t;
      const double ticks = std::abs(static_cast<double>(state.ticks[row]) - past->ticks[row]) / t;
      if (speed > limits_.velocity) answer = JointViolation{Limit::kVelocity, j, speed, limits_.velocity};
      if (ticks > limits_.ticks_per_s) answer = JointViolation{Limit::kTicks, j, ticks, limits_.ticks_per_s};
    }
  }
  const Duration apart = limits_.velocity_window / (kPast / 2);
  if (count_ == 0 || state.stamp - past_[static_cast<std::size_t>((count_ - 1) % kPast)].stamp >= apart)
    past_[static_cast<std::size_t>(count_++ % kPast)] = state;
  return answer;
}

JointMonitor::Answer JointMonitor::check_set_point(const JointVector& velocity, const JointState& newest) noexcept {
  const JointVector before = set_point_;
  set_point_ = velocity;
  for (int j = 0; j < kJoints; ++j) {
    const JointLimit& refused = refused_[static_cast<std::size_t>(j)];
    if (velocity[j] > 0 && newest.q[j] > refused.upper)
      return JointViolation{Limit::kRefusal, j, newest.q[j], refused.upper};
    if (velocity[j] < 0 && newest.q[j] < refused.lower)
      return JointViolation{Limit::kRefusal, j, newest.q[j], refused.lower};
    const double step = std::abs(velocity[j] - before[j]);
    if (limits_.set_point_step > 0 && step > limits_.set_point_step)
      return JointViolation{Limit::kSetPointStep, j, step, limits_.set_point_step};
  }
  return {};
}

JointMonitor::Answer JointMonitor::check_following(const JointVector& planned,
                                                   const JointVector& measured) const noexcept {
  int joint = 0;
  const double error = (planned - measured).cwiseAbs().maxCoeff(&joint);
  if (!(error > following_error_)) return {};
  return JointViolation{Limit::kFollowingError, joint, error, following_error_};
}

}  // namespace tankrig
