// A serial line's settings, and how libserial puts them on the line.
#pragma once

#include <string>

namespace tankrig {

struct SerialSettings {
  std::string device;  ///< e.g. /dev/ttyUSB0
  int baud = 115200;
  int data_bits = 8;
  char parity = 'N';  ///< N, E or O
  int stop_bits = 1;
};

/// Errors: InputError for settings that no line has.
void check_serial_settings(const SerialSettings& settings);

/// It carries whole bytes whatever its framing, and its emulator holds it open.
bool is_pseudo_terminal(int fd) noexcept;

/// Sets the line that `fd` has open: raw bytes, no flow control, reads that do not wait; a damaged byte is read as 0.
/// Returns 0, or the errno of a line that has gone meanwhile.
/// Errors: InputError for a rate or framing that it does not have.
int set_serial_line(int fd, const SerialSettings& settings);

}  // namespace tankrig
