// A lux meter's frames for an illuminance: the emulators' side of both protocols.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/lux/pce174_protocol.hpp"
#include "drivers/lux/t10a_protocol.hpp"

namespace tankrig::sim {

struct MeterState {
  LuxUnit unit = LuxUnit::kLux;
  bool hold = false;
  bool low_battery = false;
  int head = 0;  ///< T-10A only
};

/// The lowest range that holds it, rounded to the display's counts; beyond the last range the display's overflow.
std::array<std::uint8_t, kPce174LiveBytes> encode_pce174_live(double lux, const MeterState& state);

/// Four digits, ranges of 29.99 to 299900; beyond them error 5.
std::array<std::uint8_t, kT10aLongBytes> encode_t10a_measurement(double lux, const MeterState& state);

}  // namespace tankrig::sim
