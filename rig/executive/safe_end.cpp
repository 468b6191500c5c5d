#include "rig/executive/safe_end.hpp"

#include "rig/safety/end_words.hpp"

namespace tankrig {

std::string to_string(const EndState& left) {
  const std::string laser = left.laser_dark ? kLaserOff : kCutLaser;
  return laser + (left.safe() ? ", " : "; ") + (left.arm_at_rest ? kArmAtRest : kCutArm);
}

std::string to_cut(const EndState& left) {
  std::string text = left.laser_dark ? "" : kCutLaser;
  if (left.arm_at_rest) return text;
  return text + (text.empty() ? "" : "; ") + kCutArm;
}

void SafeEnd::add(const CycleRecord& r) {
  now_ = r.stamp;
  if (r.has_joints || !heard_) heard_ = r.stamp;
  const bool over =
      r.state == ExecutiveState::kDone || r.state == ExecutiveState::kStopped || r.state == ExecutiveState::kFault;
  if (!over) return;
  if (!ended_at_) ended_at_ = r.stamp;
  left_.laser_dark = r.laser && r.laser->dark();
  if (r.has_joints && r.joints.stamp > *ended_at_) {
    rest_.add(r.joints);
    news_ = r.stamp;
  }
  left_.arm_at_rest = rest_.at_rest() && now_ - news_ <= kNewsAge;
  const bool early = now_ - *ended_at_ <= kUsual;
  expected_.laser_dark = left_.laser_dark || (early && r.laser && r.laser_off.ok());
  expected_.arm_at_rest = left_.arm_at_rest || (early && r.arm_stop.ok() && now_ - *heard_ <= kNewsAge);
}

bool SafeEnd::settled() const noexcept {
  return ended_at_ && (left_.safe() || seconds(now_ - *ended_at_) > settings_.rest_timeout);
}

}  // namespace tankrig
