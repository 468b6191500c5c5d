// A camera with a plan's faults between it and its user.
#pragma once

#include <deque>

#include "core/clock.hpp"
#include "drivers/camera/camera.hpp"
#include "sim_backends/faults/fault_script.hpp"
#include "sim_backends/faults/picture_faults.hpp"

namespace tankrig::sim {

/// Behaves as the cameras' drivers do, unless a fault is active: an incomplete frame is counted and not given out; a
/// camera that sends nothing for kStall gives one time-out.
/// Threads: as Camera.
/// RT: as Camera.
class FaultyCamera final : public Camera {
 public:
  static constexpr Duration kStall = std::chrono::milliseconds{500};

  /// All outlive it.
  FaultyCamera(Camera& camera, FaultScript& script, Clock& clock);

  CameraInfo info() const override { return info_; }
  Status start() override;
  Result<std::optional<Frame>> try_grab() override;
  std::optional<Stamp> next_frame_at() const override { return camera_.next_frame_at(); }
  void stop() noexcept override;
  CameraCounters counters() const override;
  Status trigger() override { return camera_.trigger(); }
  Statistics statistics() const override { return camera_.statistics(); }

 private:
  struct Late {
    Stamp due;
    Frame frame;
  };

  const FaultSpec* active(FaultKind kind, Stamp now) const noexcept {
    return script_.active(FaultDevice::kCamera, kind, now, info_.name);
  }
  void take_time();
  /// Takes a new frame; true if it is to be handed on.
  bool survives(Frame& frame, Stamp now);

  Camera& camera_;
  FaultScript& script_;
  Clock& clock_;
  const CameraInfo info_;
  FaultDice lost_;
  PictureFaults pictures_;
  std::deque<Late> late_;
  bool running_ = false;
  Stamp heard_{};
  std::uint64_t lost_count_ = 0, torn_count_ = 0;
};

}  // namespace tankrig::sim
