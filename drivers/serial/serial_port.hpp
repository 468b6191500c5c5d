// A serial line, set up by libserial, read and written without blocking.
//
// libserial puts baud rate, framing and flow control on it (serial_settings.hpp). The rest is ours, because libserial's
// - Open() changes the settings of a line that another program has: ours is locked first;
// - Read() looks every millisecond, allocates and throws; Write() waits for ever for a line that takes nothing;
// - IsDataAvailable() takes a line that has hung up for an idle one;
// - Close() puts the old settings back under bytes that are still being sent, and throws where the device has gone, as
//   its destructor does: so it is closed as soon as the line is set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/result.hpp"
#include "drivers/serial/serial_settings.hpp"

namespace tankrig {

/// Opened exclusively: a second open of the same line is refused.
/// Threads: one, except where said.
/// RT: try_read, try_write, discard_input are safe; open, reopen and wait_readable never.
class SerialPort {
 public:
  /// Errors: InputError that says what to do: no such device, no permission (which group), in use, not a terminal,
  /// unsupported baud rate.
  explicit SerialPort(const SerialSettings& settings);
  /// A line that another process has opened and set, and may still use: takes `line`, -1 for none yet. reopen() sets
  /// the line as it was set then, without allocating.
  SerialPort(const SerialSettings& settings, int line);
  ~SerialPort();
  SerialPort(SerialPort&&) noexcept;
  SerialPort& operator=(SerialPort&&) noexcept;

  /// Bytes read, 0 if none wait.
  /// Errors: kDisconnected when the line has hung up or the device is gone.
  Result<std::size_t> try_read(std::span<std::uint8_t> into) noexcept;
  /// Returns the bytes accepted: fewer than given when the line's buffer is full.
  /// Errors: kDisconnected.
  Result<std::size_t> try_write(std::span<const std::uint8_t> bytes) noexcept;
  /// Writes what the line accepts, whatever its state and whatever another thread is doing with it: the bytes may land
  /// inside that thread's.
  /// Threads: any. Async-signal-safe.
  void write_regardless(std::span<const std::uint8_t> bytes) const noexcept;
  /// Discards received bytes.
  Status discard_input() noexcept;
  /// Waits until bytes can be read.
  /// Errors: kTimeout, kDisconnected.
  Status wait_readable(Duration timeout) noexcept;
  /// Closes the line and opens it again. Call it soon after kDisconnected, so that a replugged adapter finds its name
  /// free.
  /// Errors: kNotReady while the device is away.
  Status reopen() noexcept;
  /// Takes another process's line instead, as the second constructor.
  void take(int line) noexcept;

  /// -1 while disconnected.
  int descriptor() const noexcept;
  const SerialSettings& settings() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig
