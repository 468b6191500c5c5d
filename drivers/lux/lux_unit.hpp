// The two units a lux meter may show.
#pragma once

#include <cstdint>

#include "core/enum_names.hpp"

namespace tankrig {

enum class LuxUnit : std::uint8_t { kLux, kFootCandle };
template <>
inline constexpr std::array kNames<LuxUnit>{"lux", "foot_candle"};

/// A lumen on a square foot: 1 / 0.3048^2.
constexpr double kLuxPerFootCandle = 1 / (0.3048 * 0.3048);

constexpr double to_lux(double value, LuxUnit unit) {
  return unit == LuxUnit::kFootCandle ? value * kLuxPerFootCandle : value;
}

}  // namespace tankrig
