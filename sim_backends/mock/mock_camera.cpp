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
  if (running_) return {};
  while (middle(next_) - parameters_.exposure / 2 < clock_.now()) ++next_;
  running_ = true;
  return {};
}

Exposure MockCamera::exposure(std::int64_t n) const {
  return sample_exposure(
      middle(n), parameters_.exposure, static_cast<std::uint64_t>(n), [&](Stamp t) { return arm_.truth_at(t); },
      [&](Stamp t) { return laser_.power_at(t); });
}

Result<std::optional<Frame>> MockCamera::try_grab() {
  const Stamp now = clock_.now();
  if (!running_) return std::optional<Frame>{};
  while (ready(next_ + parameters_.buffer_frames) <= now) {
    ++next_;
    ++counters_.overrun;
  }
  while (ready(next_) <= now && dropped(next_)) {
    ++next_;
    ++counters_.lost;
  }
  if (ready(next_) > now) return std::optional<Frame>{};
  const Exposure e = exposure(next_);
  Frame frame;
  frame.image = source_(info_.name, e);
  frame.stamp = e.mid;
  frame.exposure = parameters_.exposure;
  frame.sequence = e.index;
  ++next_;
  ++counters_.delivered;
  return std::optional<Frame>(std::move(frame));
}

std::optional<Stamp> MockCamera::next_frame_at() const {
  if (!running_) return std::nullopt;
  return ready(next_);
}

}  // namespace tankrig::sim
