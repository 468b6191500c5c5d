// A camera that delivers stamped frames.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "core/camera_model.hpp"
#include "core/result.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

struct Frame {
  cv::Mat image;           ///< 8-bit, 1 channel or 3 (BGR); owned by the frame
  Stamp stamp{};           ///< middle of the exposure
  Duration stamp_sigma{};  ///< one standard deviation of `stamp`
  Duration exposure{};
  std::uint64_t sequence = 0;  ///< the device's frame count; a gap is a frame the device or the wire lost
};

struct CameraInfo {
  std::string name;
  int width = 0, height = 0, channels = 3;
  double rate_hz = 0;
};

/// What became of the frames, for the session and the doctor. Each frame is counted once. A gap in the frame numbers is
/// counted before the next frame is given out.
struct CameraCounters {
  std::uint64_t delivered = 0;
  std::uint64_t lost = 0;          ///< never came
  std::uint64_t incomplete = 0;    ///< came in part, or damaged
  std::uint64_t overrun = 0;       ///< found no room: its reader was too slow
  std::uint64_t unread = 0;        ///< whole, but the camera was stopped before its reader took it
  std::uint64_t clock_unsure = 0;  ///< whole, but the device's clock had jumped, or could not be read

  std::uint64_t left_out() const noexcept { return lost + incomplete + overrun + unread + clock_unsure; }
};

/// Threads: start, try_grab and stop from one thread, trigger from any; never the cycle's.
/// RT: never.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual CameraInfo info() const = 0;
  virtual Status start() = 0;
  /// The next complete frame; nothing if none is ready.
  /// Errors: kNotReady before start().
  virtual Result<std::optional<Frame>> try_grab() = 0;
  /// When the next frame may be ready, if the camera knows it, so that a waiting thread can sleep.
  virtual std::optional<Stamp> next_frame_at() const { return std::nullopt; }
  virtual void stop() noexcept = 0;
  virtual CameraCounters counters() const = 0;
  /// Exposes one frame now. The camera must be started and set to software trigger.
  /// Errors: kRefused if it is not set to it, kNotReady before start().
  virtual Status trigger() { return Error{ErrorCode::kRefused, 0, {}, "camera: not set to software trigger"}; }
  virtual Statistics statistics() const { return {}; }
};

}  // namespace tankrig
