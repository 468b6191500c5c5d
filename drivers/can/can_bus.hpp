// A CAN bus carrying classic frames.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/result.hpp"

namespace tankrig {

/// A classic data frame with an 11-bit identifier.
struct CanFrame {
  std::uint16_t id = 0;
  std::uint8_t length = 0;
  std::array<std::uint8_t, 8> data{};
  Stamp stamp{};  ///< reception, by the kernel where it offers it
};

/// ISO 11898 fault confinement, and what an interface adds to it.
enum class CanState : std::uint8_t { kErrorActive, kErrorWarning, kErrorPassive, kBusOff, kDown, kGone };

struct CanCounters {
  std::uint64_t sent = 0, received = 0, send_buffer_full = 0, receive_dropped = 0, error_frames = 0, bus_off = 0;
};

/// Threads: one (the cycle's).
class CanBus {
 public:
  virtual ~CanBus() = default;
  /// kRefused with os_errno ENOBUFS when the queue is full: an ordinary outcome, counted.  RT: safe.
  virtual Status try_send(const CanFrame& frame) noexcept = 0;
  /// Next received frame; nothing if none waits.  RT: safe.
  virtual Result<std::optional<CanFrame>> try_receive() noexcept = 0;
  virtual CanState state() const noexcept = 0;
  virtual CanCounters counters() const noexcept = 0;
  /// Readable when a frame waits; for poll.
  virtual int descriptor() const noexcept = 0;
};

}  // namespace tankrig
