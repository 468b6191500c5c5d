#include "sim_backends/faults/faulty_laser.hpp"

#include <cerrno>

namespace tankrig::sim {

bool FaultyLaser::mute(Stamp now) const noexcept {
  return active(FaultKind::kOff, now) || active(FaultKind::kUnplugged, now) ||
         script_.off_now(FaultDevice::kLaser, now);
}

/// What happens whether anybody asks or not.
void FaultyLaser::play(Stamp now) noexcept {
  const bool dark =
      script_.active(FaultDevice::kBeam, FaultKind::kOff, now) || script_.off_now(FaultDevice::kBeam, now);
  const bool stray = script_.active(FaultDevice::kBeam, FaultKind::kStuck, now);
  laser_.set_beam(dark ? MockBeam::kDark : stray ? MockBeam::kStuck : MockBeam::kTrue);
  if (due_ && *due_ <= now) {
    due_.reset();
    (void)Laser::set(laser_, waiting_);
  }
  if (!mute(now)) {
    mute_since_.reset();
    return;
  }
  if (!mute_since_) mute_since_ = now;
  if (now - *mute_since_ >= kWatchdog && !active(FaultKind::kStuck, now)) (void)laser_.off();
}

Status FaultyLaser::set(bool on) noexcept {
  const Stamp now = clock_.now();
  if (on) script_.mark(FaultOrigin::kLaserOn, now);
  play(now);
  if (active(FaultKind::kWriteError, now)) return Error{ErrorCode::kIo, EIO, now, "laser: switch"};
  if (on && !trusted_) return Error{ErrorCode::kNotReady, 0, now, "laser relay: switch on"};
  commanded_ = on;
  if (mute(now)) return {};
  if (!on && active(FaultKind::kStuck, now)) return {};
  if (const FaultSpec* lossy = active(FaultKind::kDropped, now); lossy && lost_.strikes(*lossy)) return {};
  if (const FaultSpec* late = active(FaultKind::kDelayed, now)) {
    if (!due_ || waiting_ != on) due_ = now + late->delay;
    waiting_ = on;
    return {};
  }
  due_.reset();
  return Laser::set(laser_, on);
}

Result<LaserState> FaultyLaser::state() noexcept {
  const Stamp now = clock_.now();
  play(now);
  if (active(FaultKind::kUnplugged, now)) {
    trusted_ = false;
    return Error{ErrorCode::kDisconnected, ENODEV, now, "laser relay: read state"};
  }
  if (mute_since_ && now - *mute_since_ >= kBelieved) {
    trusted_ = false;
    return Error{ErrorCode::kTimeout, 0, now, "laser relay: read state"};
  }
  if (active(FaultKind::kGarbage, now)) {
    trusted_ = false;
    return Error{ErrorCode::kProtocol, 0, now, "laser relay: read state"};
  }
  if (mute_since_) return last_;
  const auto read = laser_.state();
  if (!read.ok()) return read;
  trusted_ = true;
  LaserState s = read.value();
  s.commanded = commanded_;
  if (active(FaultKind::kWrong, now)) {
    s.powered = !s.powered;
    s.emitting = s.powered;
  }
  if (const FaultSpec* slow = active(FaultKind::kSlow, now); slow && s.emitting && now < s.since + slow->delay) {
    s.emitting = false;
    s.since = s.since - warm_up();
  }
  return last_ = s;
}

}  // namespace tankrig::sim
