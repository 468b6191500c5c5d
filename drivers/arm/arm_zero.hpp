// The zero file: where each relative encoder stood when its actuator was at tick 0, and how its last mover left it.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "core/arm_model.hpp"

namespace tankrig {

/// Encoders begin at 0 when the supply comes on; one that reads no farther from it may have just done so.
inline constexpr int kPowerUpTicks = 2;
inline bool near_power_up(std::uint16_t raw) noexcept {
  return std::abs(static_cast<std::int16_t>(raw)) <= kPowerUpTicks;
}

/// Holds as long as the arm keeps its supply. What else must be true before it is believed: zero_proof.hpp.
struct ArmZero {
  struct OrderlyExit {
    std::array<std::uint16_t, kJoints> raw{};  ///< of the arm at rest
    std::string at;                            ///< UTC
    bool operator==(const OrderlyExit&) const = default;
  };
  std::array<std::uint16_t, kJoints> raw{};  ///< raw reading at tick 0, modulo 65536
  std::string taken;                         ///< UTC, for people
  std::optional<OrderlyExit> exit{};         ///< none while a program may move the arm, nor after one that was killed
  std::string voided{};                      ///< why it holds no longer; empty: it may
  bool operator==(const ArmZero&) const = default;
};

/// Errors: InputError with file and line.
ArmZero load_arm_zero(const std::filesystem::path& file);

/// Whole or not at all.
/// Errors: InputError.
void save_arm_zero(const std::filesystem::path& file, const ArmZero& zero);

}  // namespace tankrig
