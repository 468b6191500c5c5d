#include "drivers/lux/pce174_protocol.hpp"

#include <algorithm>

#include "drivers/lux/malformed_reply.hpp"

namespace tankrig {
namespace {

bool is_bcd(std::uint8_t byte) noexcept { return (byte & 0x0F) <= 9 && (byte >> 4) <= 9; }
int bcd(std::uint8_t byte) noexcept { return (byte >> 4) * 10 + (byte & 0x0F); }

struct Range {
  double resolution, full_scale;
};

Range range_of(unsigned level, LuxUnit unit) noexcept {
  constexpr Range kLux[] = {{100, 400e3}, {0.1, 400}, {1, 4e3}, {10, 40e3}};
  constexpr Range kFootCandle[] = {{10, 40e3}, {0.01, 40}, {0.1, 400}, {1, 4e3}};
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
  int* const fields[] = {&live.year, &live.weekday, &live.month, &live.day, &live.hour, &live.minute, &live.second};
  for (std::size_t i = 0; i < clock.size(); ++i) *fields[i] = bcd(clock[i]);
  live.clock_valid = live.month >= 1 && live.month <= 12 && live.day >= 1 && live.day <= 31 && live.hour <= 23 &&
                     live.minute <= 59 && live.second <= 59;
  const auto digits = reply.subspan(10, 4);
  if (std::any_of(digits.begin(), digits.end(), [](std::uint8_t pair) { return pair > 99; }))
    return malformed_reply("PCE-174: digits above 99");
  const std::uint8_t stat0 = reply[14], stat1 = reply[15];
  const unsigned mode = (stat0 >> 3) & 7u;
  if (mode == 1 || mode == 7) return malformed_reply("PCE-174: undefined mode");
  live.mode = static_cast<Pce174Mode>(mode);
  live.hold = (stat0 & 0x40) != 0;
  live.auto_power_off = (stat0 & 0x80) == 0;
  live.unit = (stat0 & 0x04) ? LuxUnit::kFootCandle : LuxUnit::kLux;
  live.low_battery = (stat1 & 0x20) != 0;
  const bool negative = (stat1 & 0x10) != 0;
  live.view = static_cast<Pce174View>((stat1 >> 2) & 3u);
  live.memory = static_cast<Pce174Memory>(stat1 & 3u);
  live.stored_records = reply[16];
  live.memory_cursor = reply[17];
  if (negative && live.mode != Pce174Mode::kRelative) return malformed_reply("PCE-174: negative without relative mode");
  live.counts = 100 * digits[0] + digits[1];
  const int raw = 100 * digits[2] + digits[3];
  if (live.mode == Pce174Mode::kNormal && !live.hold && raw != live.counts)
    return malformed_reply("PCE-174: value and raw value differ");
  const Range range = range_of(stat0 & 3u, live.unit);
  live.resolution = range.resolution;
  live.full_scale = range.full_scale;
  live.value = (negative ? -1 : 1) * live.counts * range.resolution;
  live.raw_value = raw * range.resolution;
  return live;
}

}  // namespace tankrig
