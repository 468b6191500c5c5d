// What the protocols of both lux meters share: the units they may show, and a reply that none can have sent.
#pragma once

#include <cstdint>

#include "core/clock.hpp"
#include "core/enum_names.hpp"
#include "core/result.hpp"

namespace tankrig {

enum class LuxUnit : std::uint8_t { kLux, kFootCandle };
template <>
inline constexpr std::array kNames<LuxUnit>{"lux", "foot_candle"};

/// A lumen on a square foot: 1 / 0.3048^2.
constexpr double kLuxPerFootCandle = 1 / (0.3048 * 0.3048);

constexpr double to_lux(double value, LuxUnit unit) {
  return unit == LuxUnit::kFootCandle ? value * kLuxPerFootCandle : value;
}

/// `what` is a string literal.
inline Error malformed_reply(const char* what) noexcept {
  return {ErrorCode::kProtocol, 0, MonotonicClock{}.now(), what};
}

}  // namespace tankrig
