#include "rig/executive/safe_end.hpp"

namespace tankrig {

std::string to_string(const OutputsLeft& left) {
  if (left.safe()) return "laser off, arm at rest";
  std::string text = left.laser_dark ? "laser off" : "LASER MAY BE ON: cut its supply";
  text += "; ";
  return text + (left.arm_at_rest ? "arm at rest" : "ARM MAY BE MOVING: cut its power");
}

void SafeEnd::add(const CycleRecord& r) {
  now_ = r.stamp;
  const bool over =
      r.state == ExecutiveState::kDone || r.state == ExecutiveState::kStopped || r.state == ExecutiveState::kFault;
  if (!over) return;
  if (!ended_at_) ended_at_ = r.stamp;
  left_.laser_dark = r.laser_known && !r.laser_powered && !r.laser_emitting;
  if (r.has_joints && r.joints.stamp > *ended_at_) {
    rest_.add(r.joints);
    news_ = r.stamp;
  }
  left_.arm_at_rest = rest_.at_rest() && now_ - news_ <= kNewsAge;
}

bool SafeEnd::settled() const noexcept {
  return ended_at_ && (left_.safe() || seconds(now_ - *ended_at_) > settings_.rest_timeout);
}

}  // namespace tankrig
