// Whether the zero on disk still holds, by what the encoders read at the start and what the last program left.
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

/// Before anything is said to an arm or its laser.
/// Errors: InputError where another program moves the arm whose zero is kept there.
void check_nobody_moves(const std::filesystem::path& zero_file);

/// A zero is believed if the program that moved the arm last saw it at rest at its end and kept that posture in the
/// file, if the encoders read the same now, within kSettled, and if no joint that homing drives reads as at power-up.
/// While a program may move the arm, the file holds no such posture, so that whoever is killed leaves no proof; that
/// program holds the lock FILE.lock.
/// Threads: one.
/// RT: judge() and what is const and noexcept.
class ZeroProof {
 public:
  /// An encoder at rest wavers by a tick, and an arm left to itself settles by a few: 5 ticks of the elbow are 2 mrad.
  static constexpr int kSettled = 5;

  /// Loads the file if it is there. `driven`: the joints that homing drives.
  /// Errors: InputError, also where another program moves the arm.
  ZeroProof(std::filesystem::path file, JointSet driven);

  const std::optional<ArmZero>& zero() const noexcept { return zero_; }
  /// Is there a posture to compare with, and has it not been done?
  bool undecided() const noexcept { return doubt_ == Doubt::kUndecided; }
  /// Does the zero hold, by the encoders' first readings? Asked once.
  bool judge(const std::array<std::uint16_t, kJoints>& raw) noexcept;
  /// Why it does not; empty if it does.
  std::string why_not() const;

  /// Before the arm may move: takes the lock, and the posture from the file.
  /// Errors: InputError where another program moves it, or the file cannot be written.
  void begin_motion();
  /// The zero that homing found, kept by whoever homed.
  void replace(const ArmZero& zero);
  /// It holds no longer; on disk too, unless another program has written the file since: what that one left is its own.
  /// Errors: InputError, also where another program moves the arm.
  void void_it(const std::string& why);
  /// At the end: the posture of an arm that is seen at rest; nothing of another. Gives the lock back.
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
