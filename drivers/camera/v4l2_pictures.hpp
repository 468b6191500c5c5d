// From the kernel's buffers to stamped frames: damage, fields, sequence and mid-exposure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/v4l2_format.hpp"
#include "drivers/camera/v4l2_sequence.hpp"
#include "drivers/camera/v4l2_settings.hpp"
#include "drivers/camera/v4l2_stamp.hpp"

struct v4l2_buffer;

namespace tankrig {

/// What a buffer says besides its pictures.
struct V4l2Taken {
  std::uint64_t missed = 0;      ///< frames that never came before it
  std::uint64_t incomplete = 0;  ///< frames that will not be whole any more
};

/// A buffer gives no frame, one, or two (one per field), in the order of their exposure.
/// Threads: one.
/// RT: never.
class V4l2Pictures {
 public:
  struct Counts {
    std::uint64_t error_buffers = 0;     ///< the driver said so
    std::uint64_t damaged_pictures = 0;  ///< short, or a JPEG that does not decode
    std::uint64_t unpaired_fields = 0;
    std::uint64_t monotonic_stamps = 0, arrival_stamps = 0;
    bool at_start = false;  ///< of the last stamp
  };

  V4l2Pictures(const V4l2CameraSettings& settings, const V4l2Format& format, std::optional<Duration> exposure);

  /// `last_empty` and `now`: the two polls between which the buffer arrived.
  V4l2Taken add(const v4l2_buffer& buffer, std::span<const std::uint8_t> memory, Stamp last_empty, Stamp now);
  std::optional<Frame> pop();

  /// The device counts from the beginning again.
  void restart();
  /// The same, and nobody wanted what it exposed meanwhile.
  void begin_anew();
  /// Drops waiting fields.
  void forget();
  const Counts& counts() const { return counts_; }
  /// Frames delivered per frame of the device: 2 when each field is one.
  int per_frame() const { return both_fields_ ? 2 : 1; }

 private:
  MidExposure mid_of(const v4l2_buffer& buffer, Stamp last_empty, Stamp now);
  void add_two_fields(const cv::Mat& picture, FieldLayout layout, const MidExposure& mid, std::uint64_t number);
  void add_lone_field(const cv::Mat& lines, Parity parity, const MidExposure& mid, std::uint64_t number);
  void push(cv::Mat image, const MidExposure& mid, std::uint64_t number);
  V4l2Taken told(V4l2Taken taken);
  void break_frame(std::uint64_t number, std::uint64_t frames = 1);
  void drop_waiting();

  const V4l2CameraSettings settings_;
  const V4l2Format format_;
  const Duration frame_period_;
  const bool alternating_, two_fields_, both_fields_;
  V4l2Exposure exposure_;
  V4l2Sequence sequence_;
  std::uint32_t last_device_number_ = 0;
  std::uint64_t last_number_ = 0;
  std::optional<std::uint64_t> broken_;  ///< number of the last frame that was not whole
  std::uint64_t incomplete_ = 0;         ///< still to be told of
  bool monotonic_ = false;               ///< the last stamp's clock
  Counts counts_;

  struct WaitingField {
    cv::Mat lines;
    Parity parity = Parity::kTop;
    MidExposure mid;
    std::uint64_t number = 0;
  };
  std::optional<WaitingField> waiting_;  ///< the older field, until its partner comes
  std::array<std::optional<Frame>, 2> ready_;
};

}  // namespace tankrig
