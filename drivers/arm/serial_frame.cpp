#include "drivers/arm/serial_frame.hpp"

#include <algorithm>
#include <numeric>

namespace tankrig {
namespace {

constexpr std::size_t kMasterAt = 1, kSlotsAt = 4, kSlotBytes = 9, kChecksumAt = 49, kEndAt = 50;

}  // namespace

std::uint8_t serial_checksum(const SerialFrame& frame) noexcept {
  return std::accumulate(frame.begin(), frame.begin() + kChecksumAt, std::uint8_t{0},
                         [](std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a + b); });
}

SerialFrame encode(const SerialContent& content) noexcept {
  SerialFrame frame{};
  frame[0] = kStartOfFrame;
  std::copy(content.master.begin(), content.master.end(), frame.begin() + kMasterAt);
  for (std::size_t channel = 0; channel < kJoints; ++channel) {
    const SerialSlot& slot = content.slots[kChannelJoint[channel]];
    const auto at = frame.begin() + static_cast<std::ptrdiff_t>(kSlotsAt + channel * kSlotBytes);
    *at = slot.kind;
    std::copy(slot.bytes.begin(), slot.bytes.end(), at + 1);
  }
  frame[kChecksumAt] = serial_checksum(frame);
  frame[kEndAt] = kEndOfFrame;
  return frame;
}

SerialContent decode_content(const SerialFrame& frame) noexcept {
  SerialContent content;
  std::copy_n(frame.begin() + kMasterAt, content.master.size(), content.master.begin());
  for (std::size_t channel = 0; channel < kJoints; ++channel) {
    SerialSlot& slot = content.slots[kChannelJoint[channel]];
    const auto at = frame.begin() + static_cast<std::ptrdiff_t>(kSlotsAt + channel * kSlotBytes);
    slot.kind = *at;
    std::copy_n(at + 1, slot.bytes.size(), slot.bytes.begin());
  }
  return content;
}

void SerialDecoder::discard(std::size_t count) noexcept {
  std::copy(frame_.begin() + static_cast<std::ptrdiff_t>(count), frame_.begin() + static_cast<std::ptrdiff_t>(size_),
            frame_.begin());
  size_ -= count;
  counters_.discarded_bytes += count;
  in_step_ = false;
}

bool SerialDecoder::push(std::uint8_t byte) noexcept {
  if (size_ == 0 && byte != kStartOfFrame) {
    ++counters_.discarded_bytes;
    in_step_ = false;
    return false;
  }
  frame_[size_++] = byte;
  return size_ == kSerialFrameBytes && take();
}

/// A whole frame's bytes are here: it is one, or its start was none.
bool SerialDecoder::take() noexcept {
  const bool ends = frame_[kEndAt] == kEndOfFrame;
  if (ends && frame_[kChecksumAt] == serial_checksum(frame_)) {
    content_ = decode_content(frame_);
    size_ = 0;
    ++counters_.frames;
    if (!in_step_) ++counters_.resyncs;
    in_step_ = true;
    return true;
  }
  if (ends)
    ++counters_.checksum_errors;
  else if (in_step_)
    ++counters_.length_errors;
  const auto next = std::find(frame_.begin() + 1, frame_.end(), kStartOfFrame);
  discard(static_cast<std::size_t>(next - frame_.begin()));
  return false;
}

void SerialDecoder::give_up() noexcept {
  if (size_ == 0) return;
  ++counters_.length_errors;
  discard(size_);
}

}  // namespace tankrig
