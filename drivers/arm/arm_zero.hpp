// The zero file: where each relative encoder stood when its actuator was at tick 0, and how the last program left it.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "core/arm_model.hpp"

namespace tankrig {

/// Encoders start at 0 at power-up; one that reads no farther from 0 may have just started.
inline constexpr int kPowerUpTicks = 2;
inline bool near_power_up(std::uint16_t raw) noexcept {
  return std::abs(static_cast<std::int16_t>(raw)) <= kPowerUpTicks;
}

/// Valid as long as the arm keeps its supply. zero_proof.hpp says what else must hold before it is believed.
struct ArmZero {
  struct OrderlyExit {
    std::array<std::uint16_t, kJoints> raw{};  ///< of the arm at rest
    std::string at;                            ///< UTC
    bool operator==(const OrderlyExit&) const = default;
  };
  std::array<std::uint16_t, kJoints> raw{};  ///< raw reading at tick 0, modulo 65536
  std::string taken;                         ///< UTC, for people
  std::optional<OrderlyExit> exit{};         ///< none while a program may move the arm, nor after a killed one
  std::string voided{};                      ///< why it is no longer valid; empty: it may be
  bool operator==(const ArmZero&) const = default;
};

/// Errors: InputError with file and line.
ArmZero load_arm_zero(const std::filesystem::path& file);

/// Written whole or not at all.
/// Errors: InputError.
void save_arm_zero(const std::filesystem::path& file, const ArmZero& zero);

}  // namespace tankrig
