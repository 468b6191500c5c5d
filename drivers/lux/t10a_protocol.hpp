// The bytes of a Konica Minolta T-10A illuminance meter.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/result.hpp"

namespace tankrig {

// ASCII at 9600 7E1: STX, head (2), command (2), four characters, [18 of data], ETX, BCC (2), CR, LF.
// Sources: Konica Minolta's "T-10 communication manual" (T-10-E.pdf), arthurits/ErgoLux ErgoLux/ClassT10.cs,
// maslyankov/luxmeters-py konica/utils.py (CL-200A, same frames).
constexpr std::uint8_t kT10aStx = 0x02, kT10aEtx = 0x03;
constexpr std::size_t kT10aShortBytes = 14, kT10aLongBytes = 32;
constexpr int kT10aHeads = 30;  ///< heads 0 to 29

using T10aShort = std::array<std::uint8_t, kT10aShortBytes>;

/// XOR of the bytes between STX and ETX, ETX included.
std::uint8_t t10a_bcc(std::span<const std::uint8_t> from_head_to_etx) noexcept;

/// `head` 0 .. 29 (99: all), `command` 0 .. 99, `parameters` 4 characters.
T10aShort encode_t10a(int head, int command, std::string_view parameters) noexcept;

/// Command 54: before it the meter answers nothing else.
T10aShort t10a_pc_mode() noexcept;
/// Command 10: running, automatic range; with or without the colour correction factor set on the meter.
T10aShort t10a_read(int head, bool colour_correction) noexcept;

/// The four status characters of a reply.
struct T10aStatus {
  bool hold = false;
  char error = ' ';  ///< ' ' or '7': none; '1' head without power, '2' '3' EEPROM, '5' over range
  int range = 0;     ///< 1 .. 5, 0: automatic
  bool low_battery = false;
};

struct T10aReply {
  int head = 0;
  int command = 0;
  std::array<char, 4> status{};
};

struct T10aMeasurement {
  int head = 0;
  T10aStatus status;
  std::optional<double> value;    ///< illuminance, in the unit set on the meter; none: spaces
  std::optional<double> delta;    ///< against the reference set on the meter
  std::optional<double> percent;  ///< of that reference
};

/// A reply of 14 bytes.
/// Errors: kProtocol: length, STX, ETX, CR LF, BCC, digits.
Result<T10aReply> decode_t10a_short(std::span<const std::uint8_t> reply) noexcept;
/// The reply of 32 bytes to command 10.
/// Errors: kProtocol: as above, or another command, or an undefined status.
Result<T10aMeasurement> decode_t10a_measurement(std::span<const std::uint8_t> reply) noexcept;

}  // namespace tankrig
