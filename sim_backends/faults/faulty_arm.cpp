#include "sim_backends/faults/faulty_arm.hpp"

#include <cerrno>
#include <limits>

namespace tankrig::sim {
namespace {

constexpr double kNoNumbers = 0.125;  // share among garbage

}  // namespace

/// Nothing passes in either direction.
bool FaultyArm::mute(Stamp now) const noexcept {
  return active(FaultKind::kOff, now) || active(FaultKind::kBusOff, now) || active(FaultKind::kEnobufs, now) ||
         script_.off_now(FaultDevice::kArm, now);
}

Result<std::optional<JointState>> FaultyArm::try_read() noexcept {
  const Stamp now = clock_.now();
  auto read = arm_.try_read();
  if (active(FaultKind::kOff, now)) (void)arm_.stop();
  if (active(FaultKind::kUnplugged, now)) return Error{ErrorCode::kDisconnected, ENODEV, now, "arm: carrier lost"};
  if (!read.ok()) return read;
  std::optional<JointState> news = read.value();
  if (const FaultSpec* lossy = active(FaultKind::kDropped, now); news && lossy && lost_.strikes(*lossy)) news.reset();
  if (mute(now)) news.reset();
  if (news) {
    const JointState truth = *news;
    spoil(*news, now);
    last_ = truth;
  }
  if (!active(FaultKind::kStuck, now)) stuck_.reset();
  return delayed(news, now);
}

void FaultyArm::spoil(JointState& state, Stamp now) noexcept {
  if (active(FaultKind::kStuck, now)) {
    if (!stuck_) stuck_ = last_ ? *last_ : state;
    const Stamp fresh = state.stamp;
    state = *stuck_;
    state.stamp = fresh;
  }
  if (const FaultSpec* wrong = active(FaultKind::kWrong, now)) state.q[kElbow] += wrong->amount;
  if (const FaultSpec* garbage = active(FaultKind::kGarbage, now)) {
    for (int j = 0; j < kJoints; ++j)
      state.q[j] = noise_.strikes(garbage->seed, kNoNumbers)
                       ? std::numeric_limits<double>::quiet_NaN()
                       : 6 * fault_chance(garbage->seed, static_cast<std::uint64_t>(state.stamp.ns + j)) - 3;
  }
  if (active(FaultKind::kTorn, now) && last_)
    for (int j = 0; j < kJoints; j += 2) {
      state.q[j] = last_->q[j];
      state.ticks[static_cast<std::size_t>(j)] = last_->ticks[static_cast<std::size_t>(j)];
    }
  if (const FaultSpec* jump = active(FaultKind::kClockJump, now)) state.stamp = state.stamp + jump->jump;
}

std::optional<JointState> FaultyArm::delayed(std::optional<JointState> news, Stamp now) noexcept {
  const FaultSpec* delay = active(FaultKind::kDelayed, now);
  if (!delay && late_count_ == 0) return news;
  if (news && late_count_ < late_.size()) {
    late_[(late_first_ + late_count_) % late_.size()] = {delay ? now + delay->delay : now, *news};
    ++late_count_;
  }
  std::optional<JointState> out;
  while (late_count_ > 0 && late_[late_first_].due <= now) {
    out = late_[late_first_].state;
    late_first_ = (late_first_ + 1) % late_.size();
    --late_count_;
  }
  return out;
}

Result<JointVector> FaultyArm::write_velocity(const OutputRight& right, const JointVector& velocity) noexcept {
  const Stamp now = clock_.now();
  if (!velocity.isZero(0)) script_.mark(FaultOrigin::kMotion, now);
  if (active(FaultKind::kUnplugged, now)) return Error{ErrorCode::kDisconnected, ENODEV, now, "arm: carrier lost"};
  if (active(FaultKind::kBusOff, now)) return Error{ErrorCode::kNotReady, 0, now, "arm: bus-off"};
  if (active(FaultKind::kWriteError, now)) return Error{ErrorCode::kIo, EIO, now, "arm: write set-points"};
  if (mute(now)) return velocity;
  const FaultSpec* slow = active(FaultKind::kSlow, now);
  if (!slow) return arm_.write_velocity(right, velocity);
  const auto applied = arm_.write_velocity(right, slow->ratio * velocity);
  return applied.ok() ? Result<JointVector>(velocity) : applied;
}

Status FaultyArm::stop() noexcept {
  const Stamp now = clock_.now();
  if (active(FaultKind::kUnplugged, now)) return Error{ErrorCode::kDisconnected, ENODEV, now, "arm: carrier lost"};
  if (active(FaultKind::kBusOff, now)) return Error{ErrorCode::kNotReady, 0, now, "arm: bus-off"};
  if (active(FaultKind::kEnobufs, now)) return Error{ErrorCode::kRefused, ENOBUFS, now, "arm: send queue full"};
  if (active(FaultKind::kWriteError, now)) return Error{ErrorCode::kIo, EIO, now, "arm: stop"};
  if (script_.off_now(FaultDevice::kArm, now)) return {};
  return arm_.stop();
}

}  // namespace tankrig::sim
