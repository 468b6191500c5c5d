// A log of the traffic on a CAN bus, in the text format of `candump -L`.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tankrig {

/// One line: "(1436509052.249713) can0 044#2A366C2BBA". Any frame of any bus: standard and extended data and remote
/// frames, error frames, CAN FD. Format: can-utils, candump.c and lib.c (sprint_canframe).
struct CanLogEntry {
  std::int64_t wall_ns = 0;  ///< CLOCK_REALTIME
  bool nanoseconds = false;  ///< nine digits of a second instead of six
  std::string interface;
  int column = 0;         ///< width the interface's name is padded to, if several were logged
  canfd_frame frame{};    ///< can_id with its EFF, RTR and ERR flags
  bool fd = false;        ///< CAN FD, `frame.flags` valid
  std::uint8_t dlc = 0;   ///< 9 to 15 on a classic frame of eight bytes sent with such a code
  char direction = '\0';  ///< 'R' or 'T' if the log tells

  friend bool operator==(const CanLogEntry&, const CanLogEntry&);
};

/// Without the line end. Entries read from candump's log are written back byte for byte.
void append_line(const CanLogEntry& entry, std::string& text);

/// Errors: InputError "FILE:LINE: ...".
CanLogEntry parse_can_log_line(std::string_view line, const std::filesystem::path& file = {}, int number = 1);

struct CanLog {
  std::vector<CanLogEntry> entries;
  std::size_t cut_bytes = 0;  ///< after the last end of line: a line cut short by a crash, not an entry
};

/// Errors: InputError "FILE: ..." or "FILE:LINE: ...".
CanLog read_can_log(const std::filesystem::path& file);
CanLog parse_can_log(std::string_view text, const std::filesystem::path& file = {});

}  // namespace tankrig
