#include "sim_backends/wire/lux_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tankrig::sim {
namespace {

double in_unit(double lux, LuxUnit unit) { return unit == LuxUnit::kLux ? lux : lux / kLuxPerFootCandle; }

}  // namespace

std::array<std::uint8_t, kPce174LiveBytes> encode_pce174_live(double lux, const MeterState& state) {
  const double value = std::max(0.0, in_unit(lux, state.unit));
  const double finest = state.unit == LuxUnit::kLux ? 0.1 : 0.01;
  constexpr std::uint8_t kLevels[] = {1, 2, 3, 0};  // from the finest to the coarsest
  int range = 0;
  double resolution = finest;
  while (range < 3 && std::round(value / resolution) > 4000) {
    ++range;
    resolution = finest * std::pow(10, range);
  }
  const double counts = std::round(value / resolution);
  const int shown = counts > 4000 ? 9999 : static_cast<int>(counts);
  std::array<std::uint8_t, kPce174LiveBytes> bytes{0xAA, 0xDD, 0x00, 0x19, 0x07, 0x03, 0x10, 0x17, 0x18, 0x32};
  bytes[10] = bytes[12] = static_cast<std::uint8_t>(shown / 100);
  bytes[11] = bytes[13] = static_cast<std::uint8_t>(shown % 100);
  bytes[14] = static_cast<std::uint8_t>(0x80 | (state.hold ? 0x40 : 0) |
                                        (state.unit == LuxUnit::kFootCandle ? 0x04 : 0) | kLevels[range]);
  bytes[15] = state.low_battery ? 0x20 : 0x00;
  return bytes;
}

std::array<std::uint8_t, kT10aLongBytes> encode_t10a_measurement(double lux, const MeterState& state) {
  const double value = std::max(0.0, in_unit(lux, state.unit));
  int range = 1;
  double resolution = 0.01;
  while (range < 5 && std::round(value / resolution) > 2999) resolution = 0.01 * std::pow(10, range++);
  const double counts = std::round(value / resolution);
  const bool over = counts > 2999;
  std::array<std::uint8_t, kT10aLongBytes> bytes{};
  fmt::format_to(bytes.begin(), "\x02{:02}10{}{}{}{}+{:04}{}{:12}\x03", static_cast<unsigned>(state.head) % 100U,
                 state.hold ? '1' : '0', over ? '5' : ' ', range, state.low_battery ? '1' : '0',
                 over ? 0 : static_cast<int>(counts), range + 1, "");
  fmt::format_to(bytes.begin() + 28, "{:02X}\r\n", t10a_bcc(std::span<const std::uint8_t>(bytes).subspan(1, 27)));
  return bytes;
}

}  // namespace tankrig::sim
