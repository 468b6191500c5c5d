// One relative 16-bit encoder: unwrapped, freed of the false zeros it reports now and then.
#pragma once

#include <cstdint>
#include <optional>

#include "core/time.hpp"

namespace tankrig {

struct EncoderTrackSettings {
  int jump_ticks = 800;           ///< a larger change between two readings is taken for false
  int persists_samples = 3;       ///< until this many readings in a row agree with it
  double max_ticks_per_s = 4095;  ///< what may be believed after a pause: no axis is faster
};

/// Threads: one.  RT: safe.
class EncoderTrack {
 public:
  enum class Reading : std::uint8_t {
    kStarting,  ///< too few readings agree yet
    kGood,
    kRejected,  ///< a jump: the position is carried on with the speed before it
    kJumped,    ///< the new place persisted: the encoder has lost its reference, or the arm its supply
  };

  explicit EncoderTrack(const EncoderTrackSettings& settings = {}) : settings_(settings) {}

  Reading take(std::uint16_t raw, Stamp when) noexcept;
  /// Begins anew, as after construction; the zero stays.
  void restart() noexcept;

  bool started() const noexcept { return started_; }

  /// The raw reading that is tick 0 of the actuator. It outlives a restart of this program, not one of the arm.
  void set_zero(std::uint16_t raw) noexcept;

  /// Since power-up, or since the zero where there is one; unwrapped.
  std::int32_t ticks() const noexcept { return ticks_; }
  std::uint16_t raw() const noexcept { return raw_; }
  /// Over about the last 40 ms or five readings, whichever is longer [ticks/s]. An encoder that wavers by a tick about
  /// its place is at rest.
  double speed() const noexcept;

 private:
  static constexpr std::int32_t kWaver = 1;
  static constexpr int kPast = 64;  // kSpan at 1 kHz
  static constexpr Duration kSpan = std::chrono::milliseconds(40);
  struct Past {
    std::int32_t ticks = 0;
    std::int32_t settled = 0;  ///< follows the ticks once they are farther than kWaver from it
    Stamp when{};
  };

  void accept(std::uint16_t raw, Stamp when) noexcept;
  void anchor(std::uint16_t raw, Stamp when) noexcept;
  const Past& newest() const noexcept { return past_[static_cast<std::size_t>((count_ - 1) % kPast)]; }

  EncoderTrackSettings settings_;
  std::uint16_t zero_ = 0;
  bool started_ = false;
  std::uint16_t raw_ = 0;  // last believed
  std::int32_t ticks_ = 0;
  std::uint16_t candidate_ = 0;  // last one not believed
  int agreeing_ = 0;             // readings in a row that agree with it
  Past past_[kPast]{};
  std::int64_t count_ = 0;
};

}  // namespace tankrig
