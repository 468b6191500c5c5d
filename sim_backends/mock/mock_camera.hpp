// A free-running camera of the simulated rig.
#pragma once

#include <functional>

#include "core/clock.hpp"
#include "drivers/camera/camera.hpp"
#include "sim_backends/mock/mock_arm.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::sim {

/// Makes the picture a camera takes of the world during an exposure.
using ImageSource = std::function<cv::Mat(const std::string& camera, const Exposure& exposure)>;

/// Exposes at start-up + phase + n / rate whether anybody looks or not, as a free-running camera does; a frame's
/// sequence number is n. A picture is made only when it is grabbed; one that is lost or overrun costs nothing. Threads:
/// one, the arm's and the laser's.
class MockCamera final : public Camera {
 public:
  MockCamera(CameraInfo info, const MockCameraParameters& parameters, const Clock& clock, MockArm& arm,
             const MockLaser& laser, ImageSource source);

  CameraInfo info() const override { return info_; }
  /// Delivers from the first frame whose exposure has not begun yet.
  Status start() override;
  Result<std::optional<Frame>> try_grab() override;
  std::optional<Stamp> next_frame_at() const override;
  void stop() noexcept override { running_ = false; }
  CameraCounters counters() const override { return counters_; }

 private:
  Stamp middle(std::int64_t n) const {
    return epoch_ + parameters_.phase + from_seconds(static_cast<double>(n) / info_.rate_hz);
  }
  Stamp ready(std::int64_t n) const { return middle(n) + parameters_.exposure / 2 + parameters_.readout; }
  bool dropped(std::int64_t n) const { return parameters_.drop_every > 0 && (n + 1) % parameters_.drop_every == 0; }
  Exposure exposure(std::int64_t n) const;

  CameraInfo info_;
  MockCameraParameters parameters_;
  const Clock& clock_;
  MockArm& arm_;
  const MockLaser& laser_;
  ImageSource source_;
  Stamp epoch_;
  bool running_ = false;
  std::int64_t next_ = 0;
  CameraCounters counters_;
};

}  // namespace tankrig::sim
