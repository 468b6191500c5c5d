// A CAN bus carrying classic frames.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/result.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

/// A classic data frame with an 11-bit identifier.
struct CanFrame {
  std::uint16_t id = 0;
  std::uint8_t length = 0;
  std::array<std::uint8_t, 8> data{};
  Stamp stamp{};  ///< reception, by the kernel where it offers it
};

/// ISO 11898 fault confinement, and what an interface adds to it.
/// kDown: the interface is not up; kGone: it does not exist (any more), or the other end of the carrier has closed.
enum class CanState : std::uint8_t { kErrorActive, kErrorWarning, kErrorPassive, kBusOff, kDown, kGone };

const char* to_string(CanState state) noexcept;

struct CanCounters {
  std::uint64_t sent = 0, received = 0, send_buffer_full = 0, receive_dropped = 0, error_frames = 0, bus_off = 0,
                no_ack = 0, foreign = 0, reopened = 0;
  std::uint64_t restarted = 0, lost_arbitration = 0, bus_errors = 0, send_timeouts = 0, controller_overflow = 0;
};

/// Names as in the session's events.csv: "can_sent", "can_received", ..., and "can_state" (order of CanState).
Statistics statistics_of(const CanCounters& counters, CanState state);

/// Threads: one at a time, except where said; state() and counters() any.
class CanBus {
 public:
  virtual ~CanBus() = default;
  /// Sends a frame. kRefused with os_errno ENOBUFS when the queue is full: normal, and counted.
  /// RT: safe.
  /// Errors: kDisconnected (interface down or gone), kNotReady (bus-off: accepted, but hardly sent), kOutOfRange.
  virtual Status try_send(const CanFrame& frame) noexcept = 0;
  /// Sends, whatever the bus's state and whatever another thread is doing with it; uncounted.
  /// Threads: any.  Async-signal-safe.
  virtual void send_regardless(const CanFrame& frame) noexcept = 0;
  /// Frames that were sent here still wait for the bus to take them, as far as the system can tell: what an adapter has
  /// taken is gone for it.
  /// RT: safe.
  virtual bool waits() const noexcept { return false; }
  /// Next received frame; nothing if none waits.
  /// RT: safe.
  /// Errors: kDisconnected with os_errno ENETDOWN or ENODEV for as long as the interface is down or gone.
  virtual Result<std::optional<CanFrame>> try_receive() noexcept = 0;
  /// By the error frames read so far, and the interface.
  virtual CanState state() const noexcept = 0;
  virtual CanCounters counters() const noexcept = 0;
  /// After kDisconnected: looks for the lost interface or hub and takes it up again. Call it repeatedly, from a thread
  /// that may wait.
  /// Errors: kNotReady while it is away.
  virtual Status reopen() noexcept = 0;
  /// Readable when a frame waits; for poll. -1 while there is no descriptor.
  virtual int descriptor() const noexcept = 0;
};

}  // namespace tankrig
