#include "sim_backends/faults/faulty_camera.hpp"

#include <cerrno>

namespace tankrig::sim {

FaultyCamera::FaultyCamera(Camera& camera, FaultScript& script, Clock& clock)
    : camera_(camera), script_(script), clock_(clock), info_(camera.info()), pictures_(info_.name, script) {}

void FaultyCamera::take_time() {
  const Stamp now = clock_.now();
  if (const FaultSpec* slow = active(FaultKind::kSlow, now)) clock_.sleep_until(now + slow->delay);
}

Status FaultyCamera::start() {
  take_time();
  const Stamp now = clock_.now();
  if (active(FaultKind::kUnplugged, now)) return Error{ErrorCode::kDisconnected, ENODEV, now, "camera: start"};
  const Status started = camera_.start();
  running_ = started.ok();
  heard_ = clock_.now();
  return started;
}

void FaultyCamera::stop() noexcept {
  running_ = false;
  lost_count_ += late_.size();
  late_.clear();
  camera_.stop();
}

CameraCounters FaultyCamera::counters() const {
  CameraCounters c = camera_.counters();
  c.lost += lost_count_;
  c.incomplete += torn_count_;
  c.delivered -= lost_count_ + torn_count_;
  return c;
}

bool FaultyCamera::survives(Frame& frame, Stamp now) {
  const FaultSpec* lossy = active(FaultKind::kDropped, now);
  if (active(FaultKind::kOff, now) || active(FaultKind::kUnplugged, now) ||
      script_.off_now(FaultDevice::kCamera, now, info_.name) || (lossy && lost_.strikes(*lossy))) {
    ++lost_count_;
    return false;
  }
  heard_ = now;
  if (active(FaultKind::kTorn, now)) {
    ++torn_count_;
    return false;
  }
  frame.image = pictures_.spoilt(std::move(frame.image), frame.sequence, now);
  if (const FaultSpec* jump = active(FaultKind::kClockJump, now)) frame.stamp = frame.stamp + jump->jump;
  return true;
}

Result<std::optional<Frame>> FaultyCamera::try_grab() {
  take_time();
  const Stamp now = clock_.now();
  while (true) {
    auto read = camera_.try_grab();
    if (!read.ok()) return read;
    if (!read.value()) break;
    if (!survives(*read.value(), now)) continue;
    const FaultSpec* late = active(FaultKind::kDelayed, now);
    if (!late && late_.empty()) return read;
    late_.push_back({late ? now + late->delay : now, std::move(*read.value())});
  }
  if (active(FaultKind::kUnplugged, now)) return Error{ErrorCode::kDisconnected, ENODEV, now, "camera: vanished"};
  if (!late_.empty() && late_.front().due <= now) {
    Frame frame = std::move(late_.front().frame);
    late_.pop_front();
    return std::optional<Frame>(std::move(frame));
  }
  const bool silent = active(FaultKind::kOff, now) || active(FaultKind::kIntermittent, now);
  if (running_ && silent && now - heard_ > kStall) {
    heard_ = now;
    return Error{ErrorCode::kTimeout, 0, now, "camera: no frames"};
  }
  return std::optional<Frame>{};
}

}  // namespace tankrig::sim
