// The four bytes that the program and a watchdog box send each other where a line carries bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tankrig {

/// A lead byte, a value, the number of a beat, and a check sum over the three: CRC-8, polynomial 0x07, begun at 0.
using BoxFrame = std::array<std::uint8_t, 4>;

/// `value` of the program's is 0, of the box's the sum of its BoxState bits. `beat`: of the program's the number of this
/// beat, of the box's the newest it has taken.
struct BoxMessage {
  std::uint8_t value = 0, beat = 0;
  bool operator==(const BoxMessage&) const = default;
};

inline constexpr std::uint8_t kBeatLead = 0xA5, kReplyLead = 0x5A;

enum BoxState : std::uint8_t {
  kBoxEnabled = 1,      ///< both contactors are closed, and their feedback says so
  kBoxBeatsSeen = 2,    ///< enough good beats for a reset
  kBoxContactStuck = 4  ///< a contactor's feedback contradicts its coil: no reset until it is repaired
};

/// RT: safe, as all here.
inline std::uint8_t box_check_sum(const std::uint8_t* bytes, std::size_t count) noexcept {
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum = static_cast<std::uint8_t>(sum ^ bytes[i]);
    for (int bit = 0; bit < 8; ++bit) sum = static_cast<std::uint8_t>(sum & 0x80 ? (sum << 1) ^ 0x07 : sum << 1);
  }
  return sum;
}

inline BoxFrame encode_box(std::uint8_t lead, const BoxMessage& message) noexcept {
  BoxFrame frame{lead, message.value, message.beat, 0};
  frame[3] = box_check_sum(frame.data(), 3);
  return frame;
}

/// Finds the frames with one lead byte among whatever bytes come.
/// Threads: one.
class BoxReader {
 public:
  explicit BoxReader(std::uint8_t lead) noexcept : lead_(lead) {}

  /// The frame that this byte completes.
  std::optional<BoxMessage> take(std::uint8_t byte) noexcept {
    bytes_[count_++] = byte;
    while (count_ > 0 && bytes_[0] != lead_) drop_first();
    if (count_ < bytes_.size()) return {};
    if (box_check_sum(bytes_.data(), 3) == bytes_[3]) {
      count_ = 0;
      return BoxMessage{bytes_[1], bytes_[2]};
    }
    do drop_first();
    while (count_ > 0 && bytes_[0] != lead_);
    return {};
  }

 private:
  void drop_first() noexcept {
    for (std::size_t i = 1; i < count_; ++i) bytes_[i - 1] = bytes_[i];
    --count_;
  }

  std::uint8_t lead_;
  BoxFrame bytes_{};
  std::size_t count_ = 0;
};

}  // namespace tankrig
