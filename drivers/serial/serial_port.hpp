// A serial line: opened and configured by libserial, then read and written without ever blocking.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/result.hpp"

namespace tankrig {

struct SerialSettings {
  std::string device;  ///< e.g. /dev/ttyUSB0
  int baud = 115200;
  int data_bits = 8;
  char parity = 'N';  ///< N, E or O
  int stop_bits = 1;
};

/// Opened for itself alone: a second open of the same line is refused.
/// Threads: one, except where said.
/// RT: try_read, try_write, discard_input are safe; open, reopen and wait_readable never.
class SerialPort {
 public:
  /// Errors: InputError that says what to do: no such device, no permission (which group), in use, not a terminal, baud
  /// rate the line does not know.
  explicit SerialPort(const SerialSettings& settings);
  ~SerialPort();
  SerialPort(SerialPort&&) noexcept;
  SerialPort& operator=(SerialPort&&) noexcept;

  /// Bytes read, 0 if none wait.
  /// Errors: kDisconnected when the line has hung up or the device is gone.
  Result<std::size_t> try_read(std::span<std::uint8_t> into) noexcept;
  /// Bytes taken, fewer than given when the line's buffer is full.
  /// Errors: kDisconnected.
  Result<std::size_t> try_write(std::span<const std::uint8_t> bytes) noexcept;
  /// Writes what the line takes, whatever state it is in and another thread is doing with it: bytes may fall into the
  /// middle of that one's.
  /// Threads: any. Async-signal-safe.
  void write_regardless(std::span<const std::uint8_t> bytes) const noexcept;
  /// Forgets what has been received and not read.
  Status discard_input() noexcept;
  /// Waits until bytes can be read.
  /// Errors: kTimeout, kDisconnected.
  Status wait_readable(Duration timeout) noexcept;
  /// Closes the line, and opens it again: after kDisconnected, soon, so that an adapter that is plugged in again finds
  /// its name free.
  /// Errors: kNotReady while the device is away.
  Status reopen() noexcept;

  /// -1 while disconnected.
  int descriptor() const noexcept;
  const SerialSettings& settings() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig
