// The zero file: where each relative encoder stood when its actuator was at tick 0.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/arm_model.hpp"

namespace tankrig {

/// Holds as long as the arm keeps its supply: its encoders start anew at power-up. Restarts of this machine and its
/// programs do not touch it.
struct ArmZero {
  std::array<std::uint16_t, kJoints> raw{};  ///< raw reading at tick 0, modulo 65536
  std::string taken;                         ///< UTC, for people
};

/// Errors: InputError with file and line.
ArmZero load_arm_zero(const std::filesystem::path& file);

/// Whole or not at all.  Errors: InputError.
void save_arm_zero(const std::filesystem::path& file, const ArmZero& zero);

}  // namespace tankrig
