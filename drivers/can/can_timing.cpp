#include "drivers/can/can_timing.hpp"

#include <algorithm>

namespace tankrig {
namespace {

/// Counts the bits of the stuffed part of a frame as they pass.
class Wire {
 public:
  void put(std::uint32_t value, int bits) noexcept {
    for (int i = bits - 1; i >= 0; --i) {
      const bool bit = value >> i & 1;
      const bool feedback = bit != (crc_ >> 14 & 1);
      crc_ = (crc_ << 1 & 0x7FFF) ^ (feedback ? 0x4599 : 0);
      pass(bit);
    }
  }
  void put_crc() noexcept {
    const std::uint32_t crc = crc_;
    for (int i = 14; i >= 0; --i) pass(crc >> i & 1);
  }
  int bits() const noexcept { return bits_; }

 private:
  /// After five equal bits comes one of the other kind, which counts for the next five.
  void pass(bool bit) noexcept {
    ++bits_;
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    if (run_ < 5) return;
    ++bits_;
    last_ = !last_;
    run_ = 1;
  }

  std::uint32_t crc_ = 0;
  int bits_ = 0, run_ = 0;
  bool last_ = true;  // the idle bus is recessive
};

// CRC delimiter, acknowledge and its delimiter, seven bits of end of frame, three of intermission.
constexpr int kTail = 1 + 1 + 1 + 7 + 3;

}  // namespace

int frame_bits(const can_frame& frame) noexcept {
  const bool remote = frame.can_id & CAN_RTR_FLAG;
  const std::uint32_t length = std::min<std::uint32_t>(frame.can_dlc, CAN_MAX_DLEN);
  Wire wire;
  wire.put(0, 1);  // start of frame
  if (frame.can_id & CAN_EFF_FLAG) {
    const std::uint32_t id = frame.can_id & CAN_EFF_MASK;
    wire.put(id >> 18, 11);
    wire.put(0b11, 2);  // SRR, IDE
    wire.put(id & 0x3FFFF, 18);
    wire.put(remote, 1);
    wire.put(0, 2);  // r1, r0
  } else {
    wire.put(frame.can_id & CAN_SFF_MASK, 11);
    wire.put(remote, 1);
    wire.put(0, 2);  // IDE, r0
  }
  wire.put(length, 4);
  for (std::uint32_t i = 0; i < length && !remote; ++i) wire.put(frame.data[i], 8);
  wire.put_crc();
  return wire.bits() + kTail;
}

double bus_load(std::span<const CanTraffic> traffic, int bitrate) noexcept {
  double bits_per_s = 0;
  for (const CanTraffic& t : traffic) bits_per_s += t.frames_per_s * worst_frame_bits(t.length);
  return bits_per_s / bitrate;
}

}  // namespace tankrig
