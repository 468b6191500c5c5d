// The kernel's mapped picture buffers: full ones come out, empty ones go back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/v4l2_device.hpp"

struct v4l2_buffer;

namespace tankrig {

/// Memory-mapped streaming of an open device whose format is agreed.
/// Threads: one.
/// RT: never.
class V4l2Stream {
 public:
  explicit V4l2Stream(V4l2Device& device) : device_(device) {}
  ~V4l2Stream() { stop(); }
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  /// Requests `count` buffers (the device may give fewer or more, at least two) and streams.
  /// Errors: kRefused, kDisconnected, kInternal (no memory), kIo.
  Status start(int count);
  /// Returns everything; also after the device is gone.
  void stop() noexcept;
  bool running() const noexcept { return !buffers_.empty(); }
  int buffers() const noexcept { return static_cast<int>(buffers_.size()); }

  /// The oldest filled buffer; 0, EAGAIN if none is, or errno.
  int take(v4l2_buffer& buffer) noexcept;
  /// Its whole memory; `buffer.bytesused` of it is picture.
  std::span<const std::uint8_t> memory(const v4l2_buffer& buffer) const noexcept;
  int give_back(v4l2_buffer& buffer) noexcept;

 private:
  Status failed(int problem, const char* where) noexcept;

  V4l2Device& device_;
  std::vector<std::span<std::uint8_t>> buffers_;
  bool requested_ = false;  ///< the driver keeps buffers for us
};

/// kDisconnected for errors of a device that is gone, kIo for others.
ErrorCode code_of_errno(int problem) noexcept;

}  // namespace tankrig
