// A serial line's settings, and how libserial puts them on the line.
#pragma once

#include <functional>
#include <string>

namespace tankrig {

struct SerialSettings {
  std::string device;  ///< e.g. /dev/ttyUSB0
  int baud = 115200;
  int data_bits = 8;
  char parity = 'N';  ///< N, E or O
  int stop_bits = 1;
  /// Told of the descriptor whenever the line has been opened; a copy of it stays the same line. Not in a rig file.
  std::function<void(int)> opened = {};
};

/// Errors: InputError for impossible settings.
void check_serial_settings(const SerialSettings& settings);

/// Carries whole bytes whatever its framing, and its emulator holds it open.
bool is_pseudo_terminal(int fd) noexcept;

/// Sets the open line `fd`: raw bytes, no flow control, non-blocking reads; a damaged byte reads as 0. Returns 0, or
/// the errno of a line that has gone meanwhile.
/// Errors: InputError for an unsupported rate or framing.
int set_serial_line(int fd, const SerialSettings& settings);

}  // namespace tankrig
