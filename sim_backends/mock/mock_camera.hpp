// A camera of the simulated rig, free-running or triggered.
#pragma once

#include <deque>
#include <functional>
#include <mutex>

#include "core/clock.hpp"
#include "drivers/camera/camera.hpp"
#include "sim_backends/mock/mock_arm.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::sim {

/// Renders a camera's picture of the world during an exposure.
using ImageSource = std::function<cv::Mat(const std::string& camera, const Exposure& exposure)>;

/// Free-running, it exposes at start-up + phase + n / rate whether anybody looks or not, and n is the frame's sequence
/// number. Triggered, it begins to expose trigger_delay after trigger(), and numbers its exposures; it ignores a
/// trigger while it exposes. A picture is rendered only when it is grabbed, so a lost or overrun one costs nothing.
/// Threads: one, the arm's and the laser's; trigger() from any.
class MockCamera final : public Camera {
 public:
  MockCamera(CameraInfo info, const MockCameraParameters& parameters, const Clock& clock, MockArm& arm,
             const MockLaser& laser, ImageSource source);

  CameraInfo info() const override { return info_; }
  /// Delivers from the first frame whose exposure has not begun yet.
  Status start() override;
  Result<std::optional<Frame>> try_grab() override;
  std::optional<Stamp> next_frame_at() const override;
  void stop() noexcept override;
  CameraCounters counters() const override { return counters_; }
  /// Errors: kRefused on a free-running camera, kNotReady before start().
  Status trigger() override;

 private:
  struct Shot {
    std::int64_t number;
    Stamp middle;
  };

  Stamp middle(std::int64_t n) const {
    return epoch_ + parameters_.phase + from_seconds(static_cast<double>(n) / info_.rate_hz);
  }
  Stamp ready(Stamp middle) const { return middle + parameters_.exposure / 2 + parameters_.readout; }
  bool dropped(std::int64_t n) const { return parameters_.drop_every > 0 && (n + 1) % parameters_.drop_every == 0; }
  /// Takes the next exposure whose picture is ready.
  std::optional<Shot> next_shot(Stamp now);
  std::optional<Shot> next_free_running(Stamp now);
  std::optional<Shot> next_triggered(Stamp now);

  CameraInfo info_;
  MockCameraParameters parameters_;
  const Clock& clock_;
  MockArm& arm_;
  const MockLaser& laser_;
  ImageSource source_;
  Stamp epoch_;
  std::int64_t next_ = 0;
  CameraCounters counters_;

  mutable std::mutex mutex_;  // guards what follows
  bool running_ = false;
  std::deque<Shot> shots_;  // triggered, not yet grabbed
  std::int64_t triggered_ = 0;
  Stamp exposed_until_{};
};

}  // namespace tankrig::sim
