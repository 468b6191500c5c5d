// The emulated arm's end of its serial line: 51-byte frames on a pseudo-terminal.
#include <algorithm>
#include <vector>

#include "drivers/arm/serial_arm_link.hpp"
#include "sim_backends/wire/arm_wire.hpp"

namespace tankrig::sim {
namespace {

class SerialWire final : public ArmWire {
 public:
  SerialWire(const std::filesystem::path& line, ArmElectronics& electronics, const ArmEmulatorParameters& parameters,
             const Clock& clock)
      : ArmWire(electronics, parameters, clock), pty_(line) {
    SerialSettings settings;
    settings.baud = parameters.serial_baud;
    if (parameters.serial_paced) frame_time_ = serial_frame_time(settings);
  }
  ~SerialWire() override { end(); }

 protected:
  int descriptor() const override { return pty_.descriptor(); }

  Stamp attend(Stamp now) override {
    follow_plug();
    if (pty_.descriptor() < 0) return now + kIdle;
    for (;;) {
      std::array<std::uint8_t, 256> bytes;
      const auto read = pty_.try_read(bytes);
      if (!read.ok() || read.value() == 0) break;
      const Stamp arrival = clock_.now();
      for (std::size_t i = 0; i < read.value(); ++i)
        if (decoder_.push(bytes[i])) take(decoder_.content(), arrival);
    }
    while (!due_.empty() && due_.front().when <= now) {
      (void)pty_.try_write(due_.front().bytes);
      due_.pop_front();
    }
    return due_.empty() ? now + kIdle : due_.front().when;
  }

 private:
  struct Due {
    Stamp when{};
    std::vector<std::uint8_t> bytes;
  };

  void follow_plug() {
    if (plugged_ == (pty_.descriptor() >= 0)) return;
    due_.clear();
    decoder_.give_up();
    if (plugged_)
      pty_.plug();
    else
      pty_.unplug();
  }

  void take(const SerialContent& content, Stamp arrival) {
    wire_in_ = std::max(wire_in_, arrival) + frame_time_;
    ArmRequest request;
    request.kind = static_cast<HostSlot>(content.slots[0].kind & 0x0F);
    for (std::size_t j = 0; j < kJoints; ++j) request.slots[j] = content.slots[j].bytes;
    if (const auto reply = electronics_.request(request, wire_in_)) answer(*reply);
  }

  void answer(const ArmReply& reply) {
    SerialContent content;
    content.master = {reply.master.temperature, reply.master.voltage, reply.master.current};
    for (std::size_t j = 0; j < kJoints; ++j)
      content.slots[j] = {static_cast<std::uint8_t>(reply.kind), reply.slots[j]};
    const SerialFrame frame = encode(content);
    std::vector<std::uint8_t> bytes(frame.begin(), frame.end());
    const ArmEmulatorFaults faults = electronics_.faults();
    if (faults.wrong_checksum) bytes[kSerialFrameBytes - 2] ^= 0x55U;
    if (faults.truncated) bytes.resize(kSerialFrameBytes / 2);
    if (faults.garbage)
      for (int i = 0; i < 7; ++i) bytes.insert(bytes.begin(), static_cast<std::uint8_t>(random_()));
    const Stamp begin = std::max(wire_out_, wire_in_ + parameters_.turnaround + parameters_.encoder_latency);
    wire_out_ = begin + frame_time_;
    due_.push_back({wire_out_ + faults.delay, std::move(bytes)});
  }

  Pty pty_;
  Duration frame_time_{};
  SerialDecoder decoder_;
  Stamp wire_in_{}, wire_out_{};  ///< when each direction is free
  std::deque<Due> due_;
};

}  // namespace

std::unique_ptr<ArmWire> make_serial_wire(const std::filesystem::path& line, ArmElectronics& electronics,
                                          const ArmEmulatorParameters& parameters, const Clock& clock) {
  return std::make_unique<SerialWire>(line, electronics, parameters, clock);
}

}  // namespace tankrig::sim
