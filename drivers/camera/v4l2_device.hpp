// A Video for Linux driver's kernel calls, so that a test can replace the device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "core/time.hpp"

namespace tankrig {

/// One device node. Calls return 0 or errno.
/// Threads: one.
/// RT: never.
class V4l2Device {
 public:
  virtual ~V4l2Device() = default;
  /// For reading and writing, non-blocking. Closes an open one first.
  virtual int open(const std::string& path) noexcept = 0;
  virtual void close() noexcept = 0;
  /// ioctl, repeated when a signal interrupts it.
  virtual int call(unsigned long request, void* argument) noexcept = 0;
  /// Null if it fails.
  virtual std::uint8_t* map(std::size_t length, std::int64_t offset) noexcept = 0;
  virtual void unmap(std::uint8_t* memory, std::size_t length) noexcept = 0;
  /// poll's answer for `events`; 0 if nothing happened within `timeout`.
  virtual short wait(short events, Duration timeout) noexcept = 0;
  virtual int write(const std::uint8_t* bytes, std::size_t size) noexcept = 0;
  /// CLOCK_MONOTONIC.
  virtual Stamp now() const noexcept = 0;
};

std::unique_ptr<V4l2Device> kernel_v4l2_device();

}  // namespace tankrig
