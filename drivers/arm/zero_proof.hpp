// Whether the zero on disk still holds, by the first encoder readings and the last program's end.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "drivers/arm/arm_exchange.hpp"
#include "drivers/arm/arm_zero.hpp"
#include "drivers/can/owned_descriptor.hpp"

namespace tankrig {

/// Call before any contact with an arm or its laser.
/// Errors: InputError if another program moves the arm of this zero file.
void check_nobody_moves(const std::filesystem::path& zero_file);

/// A zero is believed if the last program to move the arm saw it at rest at its end and stored that posture, if the
/// encoders still read the same within kSettled, and if no homed joint reads as at power-up.
/// While a program may move the arm, the file has no such posture, so a killed program leaves no proof. That program
/// holds the lock FILE.lock.
/// Threads: one.
/// RT: judge() and what is const and noexcept.
class ZeroProof {
 public:
  /// An encoder at rest wavers by a tick, and an arm left alone settles by a few: 5 ticks of the elbow are 2 mrad.
  static constexpr int kSettled = 5;

  /// Loads the file if it exists. `driven`: the joints that homing drives.
  /// Errors: InputError, also if another program moves the arm.
  ZeroProof(std::filesystem::path file, JointSet driven);

  const std::optional<ArmZero>& zero() const noexcept { return zero_; }
  /// Whether a stored posture still waits to be compared.
  bool undecided() const noexcept { return doubt_ == Doubt::kUndecided; }
  /// Whether the zero holds, by the encoders' first readings. Call once.
  bool judge(const std::array<std::uint16_t, kJoints>& raw) noexcept;
  /// Why it does not hold; empty if it does.
  std::string why_not() const;

  /// Before the arm may move: takes the lock, and removes the posture from the file.
  /// Errors: InputError if another program moves it, or the file cannot be written.
  void begin_motion();
  /// Stores the zero that homing found.
  void replace(const ArmZero& zero);
  /// Voids the zero, on disk too, unless another program has written the file since.
  /// Errors: InputError, also if another program moves the arm.
  void void_it(const std::string& why);
  /// At the end: stores the posture of an arm seen at rest, nothing otherwise. Releases the lock.
  /// Errors: InputError.
  void end_motion(const std::optional<std::array<std::uint16_t, kJoints>>& at_rest);

 private:
  enum class Doubt : std::uint8_t { kNone, kUndecided, kNoFile, kVoided, kNoExit, kElsewhere, kPowerUp };

  std::filesystem::path file_;
  JointSet driven_;
  std::optional<ArmZero> zero_;
  Doubt doubt_ = Doubt::kNoFile;
  std::size_t joint_ = 0;   ///< the one in doubt
  std::uint16_t read_ = 0;  ///< what it reads
  OwnedDescriptor lock_;
};

}  // namespace tankrig
