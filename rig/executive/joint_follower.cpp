#include "rig/executive/joint_follower.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr double kLargestCorrection = 0.2;
constexpr double kLongestStep = 0.1;  // a longer silence teaches no more than this [s]

}  // namespace

JointVector planned_when_measured(const ScanPlan& plan, double plan_time, Duration age,
                                  const JointState& measured) noexcept {
  const double stamp = plan_time - seconds(age);
  JointVector planned = plan.at(stamp).q;
  for (int j = 0; j < kJoints; ++j) {
    const Duration earlier = measured.age[static_cast<std::size_t>(j)];
    if (earlier.count() != 0) planned[j] = plan.at(stamp - seconds(earlier)).q[j];
  }
  return planned;
}

JointVector JointFollower::step(const ScanPlan& plan, double plan_time, Duration age,
                                const JointState& newest) noexcept {
  const Segment& segment = plan.segments()[plan.segment_at(plan_time)];
  const JointVector way = segment.motion.to() - segment.motion.from();
  const JointVector ahead = segment.motion.at(plan_time + settings_.control.feed_forward_lead - segment.begin).velocity;
  const JointVector error = planned_when_measured(plan, plan_time, age, newest) - newest.q;
  const double dt = learned_.ns == 0 ? 0 : std::min(seconds(newest.stamp - learned_), kLongestStep);
  learned_ = newest.stamp;

  JointVector velocity = JointVector::Zero();
  for (int j = 0; j < kJoints; ++j) {
    if (way[j] == 0) continue;
    if (dt > 0) learn(j, error[j], segment, plan_time - seconds(age), dt);
    const double side = way[j] > 0 ? 1 : -1;
    const double speed = side * (ahead[j] * (1 + correction_[j]) + settings_.control.position_gain * error[j]);
    const double slowest = settings_.control.dead_zone[j];
    if (speed < 0.5 * slowest) continue;  // also where the joint is ahead: never against the plan's direction
    velocity[j] = side * std::max(speed, slowest);
  }
  return velocity;
}

void JointFollower::learn(int joint, double error, const Segment& segment, double plan_time, double dt) noexcept {
  const MotionPoint measured = segment.motion.at(plan_time - segment.begin);
  const MotionPoint ahead = segment.motion.at(plan_time + settings_.control.feed_forward_lead - segment.begin);
  const double planned = measured.velocity[joint];
  const bool even = measured.acceleration[joint] == 0 && ahead.acceleration[joint] == 0;
  if (!even || std::abs(planned) < settings_.control.dead_zone[joint] || planned == 0) return;
  const double learned = correction_[joint] + settings_.control.learning_rate * dt * error / planned;
  correction_[joint] = std::clamp(learned, -kLargestCorrection, kLargestCorrection);
}

}  // namespace tankrig
