// The zero that the arm's driver uses: from homing or from a file, believed or not, lost or not.
#pragma once

#include <array>
#include <atomic>
#include <optional>
#include <string>

#include "drivers/arm/zero_proof.hpp"

namespace tankrig {

/// Where the zero is expected, if nothing has happened to the arm since.
struct ExpectedZero {
  std::array<std::uint16_t, kJoints> raw{};
  bool held =
      false;  ///< it was believed; else it is where the last program left the arm, carried over a loss of supply
};

/// Without a proof (no zero file in the settings) only homing makes the zero known, and nothing is kept on disk.
/// Threads: one; known() any.
/// RT: known(), may_move(), judge(), expected(), set(), lose().
class KnownZero {
 public:
  /// The zero of a file: nothing may be driven until begin_motion().
  void set_proof(ZeroProof proof);

  bool known() const noexcept { return known_.load(std::memory_order_relaxed); }
  bool may_move() const noexcept { return may_move_; }

  /// Decides by the encoders' first readings: returns the file's zero if it is now believed.
  const ArmZero* judge(const std::array<std::uint16_t, kJoints>& raw) noexcept;
  /// Nothing if no zero was ever known. `raw`: the encoders now.
  std::optional<ExpectedZero> expected(const std::array<std::uint16_t, kJoints>& raw) const noexcept;
  /// Homing found this zero.
  void set(const ArmZero& zero) noexcept;
  /// The zero is lost. `why`: a string literal.
  void lose(const char* why) noexcept;

  /// Why the file's zero is not believed, or no longer; empty if there is no file.
  std::string why_not() const;
  /// Allows motion.
  /// Errors: InputError.
  void begin_motion();
  /// Ends motion. `at_rest`: the encoders of an arm seen at rest.
  /// Errors: InputError.
  void end_motion(const std::optional<std::array<std::uint16_t, kJoints>>& at_rest);
  /// If the zero was lost, voids the file too.
  /// Errors: InputError.
  void keep_loss();

 private:
  std::optional<ZeroProof> proof_;
  const char* lost_ = nullptr;                ///< why the believed zero was lost
  std::array<std::uint16_t, kJoints> raw_{};  ///< while known
  bool may_move_ = true;
  std::atomic<bool> known_{false};
};

}  // namespace tankrig
