// The zero that the arm's driver goes by: from homing or from a file, believed or not, lost or not.
#pragma once

#include <array>
#include <atomic>
#include <optional>
#include <string>

#include "drivers/arm/zero_proof.hpp"

namespace tankrig {

/// Without a proof (no zero file in the settings) only homing makes it known, and nothing is kept on disk.
/// Threads: one; known() any.
/// RT: known(), may_move(), judge(), set(), lose().
class KnownZero {
 public:
  /// The zero of a file: nothing may be driven until begin_motion().
  void set_proof(ZeroProof proof);

  bool known() const noexcept { return known_.load(std::memory_order_relaxed); }
  bool may_move() const noexcept { return may_move_; }

  /// By the encoders' first readings: the file's zero, where it is believed now.
  const ArmZero* judge(const std::array<std::uint16_t, kJoints>& raw) noexcept;
  /// Homing found it.
  void set(const ArmZero& zero) noexcept;
  /// It holds no longer. `why`: a string literal.
  void lose(const char* why) noexcept;

  /// Why the zero of the file is not believed, or no longer; empty where there is no such file.
  std::string why_not() const;
  /// The arm may be driven from here on.
  /// Errors: InputError.
  void begin_motion();
  /// Not any more. `at_rest`: the encoders of an arm that was seen at rest.
  /// Errors: InputError.
  void end_motion(const std::optional<std::array<std::uint16_t, kJoints>>& at_rest);
  /// Where it was lost: voids the file too.
  /// Errors: InputError.
  void keep_loss();

 private:
  std::optional<ZeroProof> proof_;
  const char* lost_ = nullptr;  ///< why the zero that was believed is none any more
  bool may_move_ = true;
  std::atomic<bool> known_{false};
};

}  // namespace tankrig
