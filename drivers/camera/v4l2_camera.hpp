// A Video for Linux camera: the kernel's pictures, stamped, counted, and found again after a loss.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/v4l2_device.hpp"
#include "drivers/camera/v4l2_settings.hpp"

namespace tankrig {

/// Streams from memory-mapped buffers; a picture is copied once, by its conversion to 8-bit grey or BGR. try_grab looks
/// for a lost device every `settings.retry`; the device must come back unchanged.
/// Threads: one, never the cycle's.
/// RT: never.
/// Errors: the constructor throws InputError, one line that says what to do. try_grab: kDisconnected while the device
/// is away; kTimeout once when it is silent for `settings.timeout`; kIo after repeated failures.
class V4l2Camera final : public Camera {
 public:
  explicit V4l2Camera(const V4l2CameraSettings& settings) : V4l2Camera(settings, kernel_v4l2_device()) {}
  V4l2Camera(const V4l2CameraSettings& settings, std::unique_ptr<V4l2Device> device);
  ~V4l2Camera() override;

  CameraInfo info() const override;
  /// Also restarts after an error.
  Status start() override;
  Result<std::optional<Frame>> try_grab() override;
  std::optional<Stamp> next_frame_at() const override;
  void stop() noexcept override;
  CameraCounters counters() const override;
  Statistics statistics() const override;

  /// Sleeps until try_grab may have a frame, at most `timeout`.
  void wait(Duration timeout) noexcept;
  /// What differs from the request or is unsuitable for measuring, one line each.
  const std::vector<std::string>& warnings() const;
  /// One line for the session and the doctor: device, format, field order, controls.
  std::string description() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig
