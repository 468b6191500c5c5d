// The bytes of a PCE-174 (Extech HD450) light meter.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/result.hpp"
#include "drivers/lux/lux_protocol.hpp"

namespace tankrig {

// Source of all below: philpagel/PCE174-communication, protocol.md. 9600 8N1, no checksum.
inline constexpr std::array<std::uint8_t, 3> kPce174LiveRequest{0x87, 0x83, 0x11};
inline constexpr std::array<std::uint8_t, 2> kPce174LiveMagic{0xAA, 0xDD};
inline constexpr std::size_t kPce174LiveBytes = 18;

enum class Pce174Mode : std::uint8_t { kNormal = 0, kPeakMin = 2, kPeakMax = 3, kMax = 4, kMin = 5, kRelative = 6 };
enum class Pce174Memory : std::uint8_t { kNone = 0, kStore = 1, kRecall = 2, kLogging = 3 };

/// What the display shows now. The instrument's own clock is not read: it is known to hold seconds beyond 59.
struct Pce174Live {
  double value = 0;       ///< as shown [unit]
  int counts = 0;         ///< of the display, 0 .. 9999
  double resolution = 0;  ///< of one count [unit]
  LuxUnit unit = LuxUnit::kLux;
  Pce174Mode mode = Pce174Mode::kNormal;
  bool hold = false;
  bool low_battery = false;
  Pce174Memory memory = Pce174Memory::kNone;

  double lux() const noexcept { return to_lux(value, unit); }
  /// The display has 4000 counts in every range. How the meter sends its "OL" is not public, so more counts are treated
  /// as "OL".
  bool overload() const noexcept { return counts > 4000; }
};

/// Errors: kProtocol: not 18 bytes, not its magic, a digit pair above 99, an undefined mode, a minus outside
/// `relative`, or, in normal mode without hold, a value that is not its raw value.
Result<Pce174Live> decode_pce174_live(std::span<const std::uint8_t> reply) noexcept;

}  // namespace tankrig
