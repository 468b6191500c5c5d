// The arm's public 51-byte serial frame, the same shape both ways: E7, three master bytes, five channel slots of nine
// bytes, checksum, E5.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/arm_model.hpp"
#include "drivers/arm/joint_slot.hpp"

namespace tankrig {

inline constexpr std::size_t kSerialFrameBytes = 51;
inline constexpr std::uint8_t kStartOfFrame = 0xE7, kEndOfFrame = 0xE5;
using SerialFrame = std::array<std::uint8_t, kSerialFrameBytes>;

/// Joint of each channel on the wire: not the order of `Joint`.
inline constexpr std::array<Joint, kJoints> kChannelJoint{kShoulder, kSlew, kElbow, kJawRotate, kJawOpening};

struct SerialSlot {
  std::uint8_t kind = 0;  ///< HostSlot or ArmSlot in the low nibble
  SlotBytes bytes{};
  bool operator==(const SerialSlot&) const = default;
};

/// A frame without its wrapping; slots in the order of `Joint`.
struct SerialContent {
  std::array<std::uint8_t, 3> master{};
  std::array<SerialSlot, kJoints> slots{};
  bool operator==(const SerialContent&) const = default;
};

/// Sum of bytes 0..48 modulo 256.
/// RT: safe.
std::uint8_t serial_checksum(const SerialFrame& frame) noexcept;
SerialFrame encode(const SerialContent& content) noexcept;
SerialContent decode_content(const SerialFrame& frame) noexcept;

struct SerialDecoderCounters {
  std::uint64_t frames = 0;
  std::uint64_t checksum_errors = 0;  ///< wrapped well, summed wrong
  std::uint64_t length_errors = 0;    ///< no end of frame where it must be, or cut off
  std::uint64_t discarded_bytes = 0;
  std::uint64_t resyncs = 0;  ///< good frames found again after garbage
};

/// Finds frames in a stream of bytes. E7 and E5 are also data, so a start counts only with a valid end and sum; after a
/// failure every byte is tried as a start.
/// Threads: one.
/// RT: safe.
class SerialDecoder {
 public:
  /// Takes one byte; true if it completes a frame, now in content().
  bool push(std::uint8_t byte) noexcept;
  const SerialContent& content() const noexcept { return content_; }
  /// Drops a partial frame: its rest will not come.
  void give_up() noexcept;
  const SerialDecoderCounters& counters() const noexcept { return counters_; }

 private:
  void discard(std::size_t count) noexcept;
  bool take() noexcept;

  SerialFrame frame_{};
  std::size_t size_ = 0;
  bool in_step_ = true;  ///< the last thing seen was a good frame, or nothing
  SerialContent content_;
  SerialDecoderCounters counters_;
};

}  // namespace tankrig
