// Common parts of both lux meters' protocols: units, and the error for an impossible reply.
#pragma once

#include <cstdint>

#include "core/clock.hpp"
#include "core/enum_names.hpp"
#include "core/result.hpp"

namespace tankrig {

enum class LuxUnit : std::uint8_t { kLux, kFootCandle };
template <>
inline constexpr std::array kNames<LuxUnit>{"lux", "foot_candle"};

/// One lumen per square foot: 1 / 0.3048^2.
constexpr double kLuxPerFootCandle = 1 / (0.3048 * 0.3048);

constexpr double to_lux(double value, LuxUnit unit) {
  return unit == LuxUnit::kFootCandle ? value * kLuxPerFootCandle : value;
}

/// `what` is a string literal.
inline Error malformed_reply(const char* what) noexcept {
  return {ErrorCode::kProtocol, 0, MonotonicClock{}.now(), what};
}

}  // namespace tankrig
