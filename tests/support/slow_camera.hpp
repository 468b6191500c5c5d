// A camera that takes its time to start or to stop, as real ones do.
#pragma once

#include <utility>

#include "core/clock.hpp"
#include "drivers/camera/camera.hpp"

namespace tankrig::testing_support {

/// Each only once.
class SlowCamera final : public Camera {
 public:
  SlowCamera(Camera& camera, Clock& clock, Duration to_start, Duration to_stop = {})
      : camera_(camera), clock_(clock), to_start_(to_start), to_stop_(to_stop) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override {
    pass(to_start_);
    return camera_.start();
  }
  Result<std::optional<Frame>> try_grab() override { return camera_.try_grab(); }
  std::optional<Stamp> next_frame_at() const override { return camera_.next_frame_at(); }
  void stop() noexcept override {
    pass(to_stop_);
    camera_.stop();
  }
  CameraCounters counters() const override { return camera_.counters(); }

 private:
  void pass(Duration& time) noexcept { clock_.sleep_until(clock_.now() + std::exchange(time, Duration{})); }

  Camera& camera_;
  Clock& clock_;
  Duration to_start_, to_stop_;
};

}  // namespace tankrig::testing_support
