#include "drivers/lux/t10a_protocol.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/lux/lux_protocol.hpp"

namespace tankrig {
namespace {

using Bytes = std::span<const std::uint8_t>;

bool is_digit(std::uint8_t c) noexcept { return c >= '0' && c <= '9'; }

/// Both cases: meters and programs differ.
int hex_value(std::uint8_t c) noexcept {
  if (is_digit(c)) return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

std::optional<int> two_digits(Bytes at) noexcept {
  if (!is_digit(at[0]) || !is_digit(at[1])) return std::nullopt;
  return (at[0] - '0') * 10 + (at[1] - '0');
}

/// What is wrong with the frame around the data, nothing if it is sound.
const char* frame_fault(Bytes reply, std::size_t length) noexcept {
  if (reply.size() != length) return "T-10A: reply has a wrong length";
  if (reply[0] != kT10aStx || reply[length - 5] != kT10aEtx) return "T-10A: STX or ETX missing";
  if (reply[length - 2] != '\r' || reply[length - 1] != '\n') return "T-10A: CR LF missing";
  const int high = hex_value(reply[length - 4]), low = hex_value(reply[length - 3]);
  if (high < 0 || low < 0 || (high << 4 | low) != t10a_bcc(reply.subspan(1, length - 5)))
    return "T-10A: wrong checksum";
  if (!two_digits(reply.subspan(1, 2)) || !two_digits(reply.subspan(3, 2)))
    return "T-10A: head or command is no number";
  return nullptr;
}

/// Sign, four digits, exponent: digits * 10^(exponent - 4). False if it is neither that nor six spaces.
bool decode_block(Bytes block, std::optional<double>& value) noexcept {
  value.reset();
  if (std::all_of(block.begin(), block.end(), [](std::uint8_t c) { return c == ' '; })) return true;
  const std::uint8_t sign = block[0];
  if (sign != '+' && sign != '-' && sign != '=' && sign != ' ') return false;
  int digits = 0;
  bool begun = false;
  for (const std::uint8_t c : block.subspan(1, 4)) {
    if (c == ' ' && !begun) continue;  // leading zeros may be blank
    if (!is_digit(c)) return false;
    begun = true;
    digits = digits * 10 + (c - '0');
  }
  if (!begun || !is_digit(block[5])) return false;
  constexpr double kPowers[] = {1e-4, 1e-3, 1e-2, 1e-1, 1, 1e1, 1e2, 1e3, 1e4, 1e5};
  value = (sign == '-' ? -1 : 1) * digits * kPowers[block[5] - '0'];
  return true;
}

/// Hold and battery are the lowest bit of their digit; what the others say is not public.
bool decode_status(Bytes status, T10aStatus& out) noexcept {
  if (status[0] < '0' || status[0] > '7') return false;
  out.hold = (status[0] & 1) != 0;
  out.error = static_cast<char>(status[1]);
  if (std::string_view(" 12357").find(out.error) == std::string_view::npos) return false;
  if (status[2] < '0' || status[2] > '5') return false;
  out.range = status[2] - '0';
  if (status[3] < '0' || status[3] > '3') return false;
  out.low_battery = (status[3] & 1) != 0;
  return true;
}

}  // namespace

std::uint8_t t10a_bcc(Bytes from_head_to_etx) noexcept {
  std::uint8_t bcc = 0;
  for (const std::uint8_t byte : from_head_to_etx) bcc = static_cast<std::uint8_t>(bcc ^ byte);
  return bcc;
}

T10aShort encode_t10a(int head, int command, std::string_view parameters) noexcept {
  T10aShort bytes{};
  fmt::format_to(bytes.begin(), "\x02{:02}{:02}{:<4.4}\x03", head % 100, command % 100, parameters);
  fmt::format_to(bytes.begin() + 10, "{:02X}\r\n", t10a_bcc(Bytes(bytes).subspan(1, 9)));
  return bytes;
}

T10aShort t10a_pc_mode() noexcept { return encode_t10a(0, 54, "1   "); }
T10aShort t10a_read(int head, bool colour_correction) noexcept {
  return encode_t10a(head, 10, colour_correction ? "0300" : "0200");
}

Result<T10aReply> decode_t10a_short(Bytes reply) noexcept {
  if (const char* fault = frame_fault(reply, kT10aShortBytes)) return malformed_reply(fault);
  T10aReply r;
  r.head = *two_digits(reply.subspan(1, 2));
  r.command = *two_digits(reply.subspan(3, 2));
  std::copy_n(reply.begin() + 5, 4, r.status.begin());
  return r;
}

Result<T10aMeasurement> decode_t10a_measurement(Bytes reply) noexcept {
  if (const char* fault = frame_fault(reply, kT10aLongBytes)) return malformed_reply(fault);
  if (*two_digits(reply.subspan(3, 2)) != 10) return malformed_reply("T-10A: reply to another command");
  T10aMeasurement m;
  m.head = *two_digits(reply.subspan(1, 2));
  if (!decode_status(reply.subspan(5, 4), m.status)) return malformed_reply("T-10A: undefined status");
  if (!decode_block(reply.subspan(9, 6), m.value) || !decode_block(reply.subspan(15, 6), m.delta) ||
      !decode_block(reply.subspan(21, 6), m.percent))
    return malformed_reply("T-10A: value is no number");
  return m;
}

}  // namespace tankrig
