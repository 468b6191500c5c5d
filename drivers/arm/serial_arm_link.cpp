#include "drivers/arm/serial_arm_link.hpp"

#include <algorithm>

namespace tankrig {
namespace {

SerialContent content_of(const ArmDemands& demands) noexcept {
  SerialContent content;
  for (std::size_t j = 0; j < kJoints; ++j)
    content.slots[j] = {static_cast<std::uint8_t>(HostSlot::kDemand), encode(demands[j])};
  return content;
}

}  // namespace

Duration serial_frame_time(const SerialSettings& settings) noexcept {
  const std::int64_t bits = 1 + settings.data_bits + (settings.parity == 'N' ? 0 : 1) + settings.stop_bits;
  return Duration{static_cast<std::int64_t>(kSerialFrameBytes) * bits * 1'000'000'000 / settings.baud};
}

SerialArmLink::SerialArmLink(SerialPort port, Duration encoder_latency)
    : port_(std::move(port)), frame_time_(serial_frame_time(port_.settings())), encoder_latency_(encoder_latency) {}

Status SerialArmLink::try_send(const ArmDemands& demands, const ArmExchange&, Stamp now) noexcept {
  return send(content_of(demands), now);
}

void SerialArmLink::send_regardless(const ArmDemands& demands) const noexcept {
  port_.write_regardless(encode(content_of(demands)));
}

Status SerialArmLink::try_send(const PidSlot& gains, Stamp now) noexcept {
  SerialContent content;
  content.slots.fill({static_cast<std::uint8_t>(HostSlot::kPid), encode(gains)});
  return send(content, now);
}

Status SerialArmLink::send(const SerialContent& content, Stamp now) noexcept {
  if (const Status flushed = flush(now); !flushed.ok()) return flushed;
  sending_ = encode(content);
  unsent_ = sending_.size();
  if (const Status flushed = flush(now); !flushed.ok()) {
    if (unsent_ == sending_.size()) unsent_ = 0;  // nothing of it is on the line
    if (unsent_ == 0) return flushed;
  }
  if (outstanding_ < kInFlight) sent_[static_cast<std::size_t>(outstanding_++)] = now;
  return {};
}

/// Puts on the line what is left of the frame before.
Status SerialArmLink::flush(Stamp now) noexcept {
  if (unsent_ == 0) return {};
  const auto taken = port_.try_write(std::span(sending_).last(unsent_));
  if (!taken.ok()) {
    unsent_ = 0;
    return taken.error();
  }
  unsent_ -= taken.value();
  if (unsent_ == 0) return {};
  ++counters_.send_buffer_full;
  return Error{ErrorCode::kRefused, 0, now, "arm: serial line takes no more"};
}

Result<std::optional<ArmAnswer>> SerialArmLink::try_receive(Stamp now) noexcept {
  (void)flush(now);
  for (;;) {
    while (taken_ < read_) {
      if (!decoder_.push(buffer_[taken_++])) continue;
      ++counters_.answers;
      return std::optional<ArmAnswer>(answer(now));
    }
    const auto read = port_.try_read(buffer_);
    if (!read.ok()) {
      if (read.error().code == ErrorCode::kDisconnected) forget();
      return read.error();
    }
    read_ = read.value();
    taken_ = 0;
    if (read_ == 0) {
      looked_ = now;
      return std::optional<ArmAnswer>{};
    }
  }
}

/// A line tells nobody when a byte came, only between which two looks; the encoders were read an answer's time before.
/// An arm that answers at once reads them when the request has come: where that lies between the two, it is the moment,
/// else the middle is.
ArmAnswer SerialArmLink::answer(Stamp now) noexcept {
  const Duration answering = frame_time_ + encoder_latency_;
  const Stamp earliest = std::min(looked_, now) - answering, latest = now - answering;
  ArmAnswer answer;
  answer.read = earliest + (latest - earliest) / 2;
  if (outstanding_ > 0) {
    const Stamp asked = sent_[0] + frame_time_;
    if (earliest <= asked && asked <= latest) answer.read = asked;
    std::copy(sent_.begin() + 1, sent_.end(), sent_.begin());
    --outstanding_;
  }
  const SerialContent& content = decoder_.content();
  answer.master = {content.master[0], content.master[1], content.master[2]};
  answer.sensors = true;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto kind = static_cast<ArmSlot>(content.slots[j].kind & 0x0F);
    if (kind > ArmSlot::kPid) ++counters_.unknown_slots;
    if (kind == ArmSlot::kSensors)
      answer.joints[j] = decode_sensors(content.slots[j].bytes);
    else
      answer.sensors = false;
  }
  return answer;
}

void SerialArmLink::forget() noexcept {
  outstanding_ = 0;
  decoder_.give_up();
}

Status SerialArmLink::reopen() noexcept {
  const Status opened = port_.reopen();
  if (!opened.ok()) return opened;
  begin_anew();
  ++counters_.reopened;
  return {};
}

void SerialArmLink::take(int line) noexcept {
  port_.take(line);
  begin_anew();
}

void SerialArmLink::begin_anew() noexcept {
  forget();
  unsent_ = read_ = taken_ = 0;
}

ArmLinkCounters SerialArmLink::counters() const noexcept {
  ArmLinkCounters all = counters_;
  const SerialDecoderCounters& line = decoder_.counters();
  all.checksum_errors = line.checksum_errors;
  all.length_errors = line.length_errors;
  all.discarded_bytes = line.discarded_bytes;
  all.resyncs = line.resyncs;
  return all;
}

}  // namespace tankrig
