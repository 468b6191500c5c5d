#include "sim_backends/mock/mock_camera.hpp"

#include <utility>

namespace tankrig::sim {

MockCamera::MockCamera(CameraInfo info, const MockCameraParameters& parameters, const Clock& clock, MockArm& arm,
                       const MockLaser& laser, ImageSource source)
    : info_(std::move(info)),
      parameters_(parameters),
      clock_(clock),
      arm_(arm),
      laser_(laser),
      source_(std::move(source)),
      epoch_(clock.now()) {}

Status MockCamera::start() {
  const std::lock_guard lock(mutex_);
  if (running_) return {};
  while (middle(next_) - parameters_.exposure / 2 < clock_.now()) ++next_;
  shots_.clear();
  running_ = true;
  return {};
}

void MockCamera::stop() noexcept {
  const std::lock_guard lock(mutex_);
  running_ = false;
}

Status MockCamera::trigger() {
  if (!parameters_.triggered) return Camera::trigger();
  const std::lock_guard lock(mutex_);
  const Stamp now = clock_.now(), begin = now + parameters_.trigger_delay;
  if (!running_) return Error{ErrorCode::kNotReady, 0, now, "camera: not started"};
  if (begin < exposed_until_) return {};
  exposed_until_ = begin + parameters_.exposure;
  shots_.push_back({triggered_++, begin + parameters_.exposure / 2});
  return {};
}

std::optional<MockCamera::Shot> MockCamera::next_free_running(Stamp now) {
  while (ready(middle(next_ + parameters_.buffer_frames)) <= now) {
    ++next_;
    ++counters_.overrun;
  }
  while (ready(middle(next_)) <= now && dropped(next_)) {
    ++next_;
    ++counters_.lost;
  }
  return Shot{next_, middle(next_)};
}

std::optional<MockCamera::Shot> MockCamera::next_triggered(Stamp now) {
  const auto most = static_cast<std::size_t>(parameters_.buffer_frames);
  while (shots_.size() > most && ready(shots_[most].middle) <= now) {
    shots_.pop_front();
    ++counters_.overrun;
  }
  while (!shots_.empty() && ready(shots_.front().middle) <= now && dropped(shots_.front().number)) {
    shots_.pop_front();
    ++counters_.lost;
  }
  if (shots_.empty()) return std::nullopt;
  return shots_.front();
}

std::optional<MockCamera::Shot> MockCamera::next_shot(Stamp now) {
  const std::lock_guard lock(mutex_);
  if (!running_) return std::nullopt;
  const auto shot = parameters_.triggered ? next_triggered(now) : next_free_running(now);
  if (!shot || ready(shot->middle) > now) return std::nullopt;
  if (parameters_.triggered)
    shots_.pop_front();
  else
    ++next_;
  return shot;
}

Result<std::optional<Frame>> MockCamera::try_grab() {
  const auto shot = next_shot(clock_.now());
  if (!shot) return std::optional<Frame>{};
  const Exposure e = sample_exposure(
      shot->middle, parameters_.exposure, static_cast<std::uint64_t>(shot->number),
      [&](Stamp t) { return arm_.truth_at(t); }, [&](Stamp t) { return laser_.power_at(t); });
  Frame frame;
  frame.image = source_(info_.name, e);
  frame.stamp = e.mid + parameters_.stamp_offset;
  frame.exposure = parameters_.exposure;
  frame.sequence = e.index;
  ++counters_.delivered;
  return std::optional<Frame>(std::move(frame));
}

std::optional<Stamp> MockCamera::next_frame_at() const {
  const std::lock_guard lock(mutex_);
  if (!running_) return std::nullopt;
  if (!parameters_.triggered) return ready(middle(next_));
  if (shots_.empty()) return std::nullopt;
  return ready(shots_.front().middle);
}

}  // namespace tankrig::sim
