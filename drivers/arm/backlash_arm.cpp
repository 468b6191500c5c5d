#include "drivers/arm/backlash_arm.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {

Result<std::optional<JointState>> BacklashArm::try_read() noexcept {
  auto news = arm_.try_read();
  if (!news.ok() || !news.value()) return news;
  JointState state = *news.value();
  for (int j = 0; j < kJoints; ++j) {
    const auto row = static_cast<std::size_t>(j);
    if (play_[row] <= 0) continue;
    const double ticks = state.ticks[row], half = 0.5 * play_[row];
    link_[row] = known_ ? std::clamp(link_[row], ticks - half, ticks + half) : ticks;
    if (std::isfinite(state.q[j])) state.q[j] = model_.actuators[row].angle(link_[row]);
  }
  known_ = true;
  return std::optional<JointState>(state);
}

}  // namespace tankrig
