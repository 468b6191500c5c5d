// The joint slots in the arm's 51-byte serial frame: a request, then its answer.
#pragma once

#include <memory>

#include "drivers/arm/arm_link.hpp"
#include "drivers/arm/serial_frame.hpp"
#include "drivers/serial/serial_port.hpp"

namespace tankrig {

/// Time one frame takes on the line: 51 bytes of a start bit, the data bits, parity and stop bits.
Duration serial_frame_time(const SerialSettings& settings) noexcept;

class SerialArmLink final : public ArmLink {
 public:
  /// `encoder_latency`: from reading the encoders to the first bit of the answer.
  explicit SerialArmLink(SerialPort port, Duration encoder_latency = {});

  Status try_send(const ArmDemands& demands, const ArmExchange& exchange, Stamp now) noexcept override;
  Status try_send(const PidSlot& gains, Stamp now) noexcept override;
  void send_regardless(const ArmDemands& demands) const noexcept override;
  Result<std::optional<ArmAnswer>> try_receive(Stamp now) noexcept override;
  int outstanding() const noexcept override { return outstanding_; }
  void forget() noexcept override;
  Status reopen() noexcept override;
  bool needs_reopen() const noexcept override { return port_.descriptor() < 0; }
  /// Another process's line instead: SerialPort::take().
  void take(int line) noexcept;
  Duration exchange_time() const noexcept override { return 2 * frame_time_; }
  ArmLinkCounters counters() const noexcept override;

 private:
  static constexpr int kInFlight = 4;
  static constexpr std::size_t kReadAtOnce = 256;

  Status send(const SerialContent& content, Stamp now) noexcept;
  void begin_anew() noexcept;
  Status flush(Stamp now) noexcept;
  ArmAnswer answer(Stamp now) noexcept;

  SerialPort port_;
  Duration frame_time_;
  Duration encoder_latency_;
  SerialDecoder decoder_;
  SerialFrame sending_{};
  std::size_t unsent_ = 0;  ///< bytes at the end of `sending_` that the line has not taken yet
  std::array<Stamp, kInFlight> sent_{};
  int outstanding_ = 0;
  std::array<std::uint8_t, kReadAtOnce> buffer_{};
  std::size_t read_ = 0, taken_ = 0;  ///< of the buffer
  Stamp looked_{};                    ///< the last look before this one
  ArmLinkCounters counters_;
};

}  // namespace tankrig
