#include "rig/guardian/arm_rest.hpp"

#include <algorithm>
#include <utility>

#include "drivers/arm/arm_requests.hpp"

namespace tankrig {
namespace {

constexpr int kAnswersAtOnce = 256;

}  // namespace

ArmRest::ArmRest(std::unique_ptr<ArmLink> link, const Arm5eSettings& limits)
    : link_(std::move(link)), rest_(rest_demands(limits)) {}

void ArmRest::ask(Stamp now) noexcept {
  if (link_->needs_reopen() && !link_->reopen().ok()) return;
  link_->forget();
  (void)link_->try_send(rest_, {}, now);
  alter(rest_);
}

void ArmRest::listen(Stamp now) noexcept {
  for (int i = 0; i < kAnswersAtOnce; ++i) {
    const auto answer = link_->try_receive(now);
    if (!answer.ok()) {
      since_.reset();
      return;
    }
    if (!answer.value()) return;
    take(*answer.value());
  }
}

/// Readings of one answer; 16 bits wrap.
void ArmRest::take(const ArmAnswer& answer) noexcept {
  if (!answer.sensors || !answer.has.whole() || answer.has.sensors != kEveryJoint) return;
  heard_ = answer.read;
  bool stays = since_.has_value();
  for (std::size_t j = 0; stays && j < kJoints; ++j) {
    const int moved = static_cast<std::int16_t>(static_cast<std::uint16_t>(answer.joints[j].position - first_[j]));
    lowest_[j] = std::min(lowest_[j], moved);
    highest_[j] = std::max(highest_[j], moved);
    stays = highest_[j] - lowest_[j] <= kFlicker;
  }
  if (stays) return;
  since_ = answer.read;
  for (std::size_t j = 0; j < kJoints; ++j) first_[j] = answer.joints[j].position;
  lowest_.fill(0);
  highest_.fill(0);
}

}  // namespace tankrig
