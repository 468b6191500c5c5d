#include "drivers/lux/pce174_protocol.hpp"

#include <algorithm>

#include "drivers/lux/lux_protocol.hpp"

namespace tankrig {
namespace {

bool is_bcd(std::uint8_t byte) noexcept { return (byte & 0x0F) <= 9 && (byte >> 4) <= 9; }

double resolution_of(unsigned level, LuxUnit unit) noexcept {
  constexpr double kLux[] = {100, 0.1, 1, 10};
  constexpr double kFootCandle[] = {10, 0.01, 0.1, 1};
  return unit == LuxUnit::kLux ? kLux[level] : kFootCandle[level];
}

}  // namespace

Result<Pce174Live> decode_pce174_live(std::span<const std::uint8_t> reply) noexcept {
  if (reply.size() != kPce174LiveBytes) return malformed_reply("PCE-174: reply has not 18 bytes");
  if (!std::equal(kPce174LiveMagic.begin(), kPce174LiveMagic.end(), reply.begin()))
    return malformed_reply("PCE-174: reply does not begin with AA DD");
  const auto clock = reply.subspan(3, 7);
  if (reply[2] != 0 || !std::all_of(clock.begin(), clock.end(), is_bcd))
    return malformed_reply("PCE-174: reserved byte is not 0, or clock is not decimal");
  Pce174Live live;
  const auto digits = reply.subspan(10, 4);
  if (std::any_of(digits.begin(), digits.end(), [](std::uint8_t pair) { return pair > 99; }))
    return malformed_reply("PCE-174: digits above 99");
  const std::uint8_t stat0 = reply[14], stat1 = reply[15];
  const unsigned mode = (stat0 >> 3) & 7u;
  if (mode == 1 || mode == 7) return malformed_reply("PCE-174: undefined mode");
  live.mode = static_cast<Pce174Mode>(mode);
  live.hold = (stat0 & 0x40) != 0;
  live.unit = (stat0 & 0x04) ? LuxUnit::kFootCandle : LuxUnit::kLux;
  live.low_battery = (stat1 & 0x20) != 0;
  const bool negative = (stat1 & 0x10) != 0;
  live.memory = static_cast<Pce174Memory>(stat1 & 3u);
  if (negative && live.mode != Pce174Mode::kRelative) return malformed_reply("PCE-174: negative without relative mode");
  live.counts = 100 * digits[0] + digits[1];
  const int raw = 100 * digits[2] + digits[3];
  if (live.mode == Pce174Mode::kNormal && !live.hold && raw != live.counts)
    return malformed_reply("PCE-174: value and raw value differ");
  live.resolution = resolution_of(stat0 & 3u, live.unit);
  live.value = (negative ? -1 : 1) * live.counts * live.resolution;
  return live;
}

}  // namespace tankrig
