// One relative 16-bit encoder: unwrapped, without the false zeros it sometimes reports.
#pragma once

#include <cstdint>
#include <optional>

#include "core/time.hpp"

namespace tankrig {

struct EncoderTrackSettings {
  int jump_ticks = 40;            ///< how well a reading's time is known: 20 ms at the laboratory's 2000 ticks/s
  int persists_samples = 3;       ///< a rejected reading is believed once so many in a row agree with it
  double max_ticks_per_s = 4095;  ///< no axis is faster, nor is its speed known better
};

/// A reading is believed if it is near the position that the last speed predicts: within `jump_ticks` plus what the
/// fastest axis travels meanwhile. A reading of exactly 0, the value of a false one, must be within kFalseZero of that
/// position or of the last one.
/// Threads: one.
/// RT: safe.
class EncoderTrack {
 public:
  enum class Reading : std::uint8_t {
    kStarting,  ///< too few readings agree yet
    kGood,
    kRejected,  ///< it says nothing
    kJumped,    ///< unreachable readings persisted: the encoder lost its reference, or the arm its supply
  };

  explicit EncoderTrack(const EncoderTrackSettings& settings = {}) : settings_(settings) {}

  Reading take(std::uint16_t raw, Stamp when) noexcept;
  /// Starts again as after construction; the zero stays.
  void restart() noexcept;

  bool started() const noexcept { return started_; }

  /// The raw reading at the actuator's tick 0. It survives a restart of this program, not of the arm.
  void set_zero(std::uint16_t raw) noexcept;

  /// The last believed position since power-up, or since the zero if there is one; unwrapped.
  std::int32_t ticks() const noexcept { return started_ ? newest().ticks : 0; }
  std::uint16_t raw() const noexcept { return raw_; }
  /// When that was read.
  Stamp when() const noexcept { return started_ ? newest().when : Stamp{}; }
  /// Speed over about the last 40 ms or five readings, whichever is longer [ticks/s]. An encoder that wavers by one
  /// tick is at rest.
  double speed() const noexcept;

 private:
  static constexpr std::int32_t kWaver = 1;
  static constexpr int kFalseZero = 3;
  static constexpr int kPast = 64;  // kSpan at 1 kHz
  static constexpr Duration kSpan = std::chrono::milliseconds(40);
  struct Past {
    std::int32_t ticks = 0;
    std::int32_t settled = 0;  ///< follows the ticks once they are farther than kWaver from it
    Stamp when{};
  };

  bool agrees(std::uint16_t raw, Stamp when) const noexcept;
  void accept(std::uint16_t raw, Stamp when) noexcept;
  void anchor(std::uint16_t raw, Stamp when) noexcept;
  const Past& newest() const noexcept { return past_[static_cast<std::size_t>((count_ - 1) % kPast)]; }

  EncoderTrackSettings settings_;
  std::uint16_t zero_ = 0;
  bool started_ = false;
  std::uint16_t raw_ = 0;        // last believed
  std::uint16_t candidate_ = 0;  // last one not believed
  Stamp candidate_when_{};
  bool reachable_ = false;  // for an axis, when the first of them came
  int agreeing_ = 0;        // readings in a row that agree with it
  Past past_[kPast]{};
  std::int64_t count_ = 0;
};

}  // namespace tankrig
