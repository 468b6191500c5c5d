// The joint slots on a CAN bus: one 11-bit identifier per joint and kind, the slot as the frame's eight bytes.
#pragma once

#include <memory>
#include <span>

#include "drivers/arm/arm_link.hpp"
#include "drivers/can/can_bus.hpp"
#include "drivers/can/open_can.hpp"

namespace tankrig {

/// Which identifier means what, in the order of `Joint`. No vendor map of this arm is public. These defaults, the order
/// of the frames and the moment of reading are this project's convention (docs/reference/arm5e.md); the rig file may
/// set every identifier.
struct ArmCanIds {
  std::array<std::uint16_t, kJoints> demand{0x201, 0x202, 0x203, 0x204, 0x205};       ///< host -> arm
  std::array<std::uint16_t, kJoints> pid{0x211, 0x212, 0x213, 0x214, 0x215};          ///< host -> arm
  std::array<std::uint16_t, kJoints> sensors{0x181, 0x182, 0x183, 0x184, 0x185};      ///< arm -> host
  std::array<std::uint16_t, kJoints> pid_answer{0x191, 0x192, 0x193, 0x194, 0x195};   ///< arm -> host
  std::array<std::uint16_t, kJoints> demand_echo{0x1A1, 0x1A2, 0x1A3, 0x1A4, 0x1A5};  ///< arm -> host
  std::uint16_t master = 0x180;  ///< arm -> host, three bytes: temperature, voltage, current

  /// What the host must receive.
  std::vector<CanFilter> arm_filters() const;
  /// What the arm must receive.
  std::vector<CanFilter> host_filters() const;
};

/// `can: ids:` of the arm in the rig file.
extern const SettingsTable<ArmCanIds> kArmCanIdKeys;

/// The last byte of a demand frame. 0: the arm waits for all five and answers with everything (the whole exchange).
/// With kActAtOnce it acts on this one at once and answers with the sensor slots of the joints in the five lowest bits,
/// the master's bytes before them if kAskMaster is set.
inline constexpr std::uint8_t kActAtOnce = 0x80, kAskMaster = 0x20;

/// Worst-case bits of one exchange: five demands, the master's bytes, five sensor slots; a fast exchange has three
/// slots.
int can_exchange_bits(bool fast = false) noexcept;

/// On a bus that takes no frames (no other node acknowledges, or it is jammed) what was sent waits in socket, interface and
/// adapter, and goes out whenever the bus is back, be it after this program's end. So while an unanswered exchange waits,
/// only rest is sent, once: nothing but that exchange and, last, rest can come late.
class CanArmLink final : public ArmLink {
 public:
  /// `encoder_latency`: from reading the encoders to the first bit of the answer.
  CanArmLink(std::unique_ptr<CanBus> bus, const ArmCanIds& ids, int bitrate, Duration encoder_latency = {});

  Status try_send(const ArmDemands& demands, const ArmExchange& exchange, Stamp now) noexcept override;
  Status try_send(const PidSlot& gains, Stamp now) noexcept override;
  void send_regardless(const ArmDemands& demands) const noexcept override;
  Result<std::optional<ArmAnswer>> try_receive(Stamp now) noexcept override;
  Status sends() const noexcept override;
  int outstanding() const noexcept override { return outstanding_; }
  void forget() noexcept override;
  Status reopen() noexcept override;
  bool needs_reopen() const noexcept override;
  Duration exchange_time() const noexcept override;
  ArmLinkCounters counters() const noexcept override;

  Statistics carrier_statistics() const override { return statistics_of(bus_->counters(), bus_->state()); }

 private:
  enum class Kind : std::uint8_t { kUnknown, kSensors, kPid, kEcho, kMaster };
  struct Meaning {
    Kind kind = Kind::kUnknown;
    std::uint8_t joint = 0;
  };

  static constexpr std::size_t kInFlight = 4;

  Status send_all(std::span<const CanFrame> frames, const ArmExchange& exchange) noexcept;
  void note_sent(const ArmExchange& exchange) noexcept;
  bool stuck() const noexcept { return unanswered_ && bus_->waits(); }
  Status refuse_stale() noexcept;
  const ArmExchange& asked() const noexcept;
  void forget_partial_answer() noexcept;
  bool take(const CanFrame& frame, Meaning meaning) noexcept;
  void mean(std::uint16_t id, Kind kind, std::size_t joint);

  std::unique_ptr<CanBus> bus_;
  ArmCanIds ids_;
  int bitrate_;
  Duration encoder_latency_;
  std::array<Meaning, 0x800> meanings_{};
  int outstanding_ = 0;
  std::array<ArmExchange, kInFlight> asked_{};  ///< by the requests that are outstanding, oldest first
  JointSet arrived_ = 0;                        ///< sensors of the answer that is coming in
  bool master_arrived_ = false;
  JointSet acknowledged_ = 0;
  ArmAnswer answer_;
  bool burst_begun_ = false;
  Duration burst_time_{};    ///< of the answer's frames so far
  bool unanswered_ = false;  ///< no answer since the newest request
  bool rest_last_ = false;   ///< which was a whole one of rest
  ArmLinkCounters counters_;
};

}  // namespace tankrig
