// The emulated arm's node on a CAN bus, by this project's convention (docs/reference/arm5e.md): when the fifth joint's demand has
// come it acts on all of them, reads every encoder at once, and sends the master's bytes and five sensor slots. A
// demand that says so is acted on at once, and answered with what it asks for.
#include <algorithm>

#include "drivers/can/can_timing.hpp"
#include "sim_backends/wire/arm_wire.hpp"

namespace tankrig::sim {
namespace {

constexpr std::uint16_t kWrongIdOffset = 0x400;
constexpr Duration kRetry = std::chrono::milliseconds(1);

class CanWire final : public ArmWire {
 public:
  CanWire(std::unique_ptr<CanBus> bus, ArmElectronics& electronics, const ArmEmulatorParameters& parameters,
          const Clock& clock)
      : ArmWire(electronics, parameters, clock), bus_(std::move(bus)) {}
  ~CanWire() override { end(); }

 protected:
  int descriptor() const override { return bus_->descriptor(); }

  Stamp attend(Stamp now) override {
    for (;;) {
      const auto received = bus_->try_receive();
      if (!received.ok()) (void)bus_->reopen();
      if (!received.ok() || !received.value()) break;
      take(*received.value());
    }
    while (!due_.empty() && due_.front().when <= now) {
      const Status sent = bus_->try_send(due_.front().frame);
      if (!sent.ok() && sent.error().code == ErrorCode::kRefused) return now + kRetry;
      due_.pop_front();
    }
    return due_.empty() ? now + kIdle : due_.front().when;
  }

 private:
  struct Due {
    Stamp when{};
    CanFrame frame;
  };

  struct Gathering {
    ArmRequest request;
    JointSet joints = 0;
  };

  Duration time_of(const CanFrame& frame) const {
    if (!parameters_.can_paced) return {};
    can_frame bits{};
    bits.can_id = frame.id;
    bits.can_dlc = frame.length;
    std::copy(frame.data.begin(), frame.data.end(), bits.data);
    return bits_duration(frame_bits(bits), parameters_.can_bitrate);
  }

  void take(const CanFrame& frame) {
    wire_free_ = std::max(wire_free_, frame.stamp) + time_of(frame);
    const ArmCanIds& ids = parameters_.can_ids;
    if (frame.length != frame.data.size()) return;
    if (gather(demands_, ids.demand, HostSlot::kDemand, frame) || gather(gains_, ids.pid, HostSlot::kPid, frame))
      return;
  }

  bool gather(Gathering& into, const std::array<std::uint16_t, kJoints>& ids, HostSlot kind, const CanFrame& frame) {
    const auto joint = std::find(ids.begin(), ids.end(), frame.id);
    if (joint == ids.end()) return false;
    const auto j = static_cast<std::size_t>(joint - ids.begin());
    const std::uint8_t asks = frame.data.back();
    if (kind == HostSlot::kDemand && (asks & kActAtOnce) != 0) {
      into.joints = 0;
      ArmRequest request{kind, {}, only(j)};
      request.slots[j] = frame.data;
      const auto reply = electronics_.request(request, wire_free_);
      answer(reply, {only(j), static_cast<JointSet>(asks & kEveryJoint), (asks & kAskMaster) != 0});
      return true;
    }
    into.request.kind = kind;
    into.request.slots[j] = frame.data;
    into.joints |= only(j);
    if (into.joints != kEveryJoint) return true;
    into.joints = 0;
    answer(electronics_.request(into.request, wire_free_), {});
    return true;
  }

  void answer(const std::optional<ArmReply>& reply, const ArmExchange& asked) {
    if (!reply || (asked.sensors == 0 && !asked.master)) return;
    const ArmEmulatorFaults faults = electronics_.faults();
    const ArmCanIds& ids = parameters_.can_ids;
    wire_free_ = wire_free_ + parameters_.turnaround + parameters_.encoder_latency;
    const auto put = [&](CanFrame frame) {
      if (faults.wrong_ids) frame.id = static_cast<std::uint16_t>((frame.id + kWrongIdOffset) & 0x7FF);
      if (faults.wrong_lengths && frame.length == 8) frame.length = 7;
      wire_free_ = wire_free_ + time_of(frame);
      due_.push_back({wire_free_ + faults.delay, frame});
    };
    if (faults.garbage)
      for (int i = 0; i < 3; ++i) {
        CanFrame noise{static_cast<std::uint16_t>(0x600 + random_() % 0x100), 8, {}, {}};
        for (std::uint8_t& byte : noise.data) byte = static_cast<std::uint8_t>(random_());
        put(noise);
      }
    if (reply->kind == ArmSlot::kSensors && asked.master && !faults.no_master)
      put({ids.master, 3, {reply->master.temperature, reply->master.voltage, reply->master.current}, {}});
    const auto& to = reply->kind == ArmSlot::kSensors ? ids.sensors : ids.pid_answer;
    for (std::size_t j = 0; j < kJoints - (faults.truncated ? 1 : 0); ++j)
      if (holds(asked.sensors, j)) put({to[j], 8, reply->slots[j], {}});
  }

  std::unique_ptr<CanBus> bus_;
  Gathering demands_, gains_;
  Stamp wire_free_{};
  std::deque<Due> due_;
};

}  // namespace

std::unique_ptr<ArmWire> make_can_wire(std::unique_ptr<CanBus> bus, ArmElectronics& electronics,
                                       const ArmEmulatorParameters& parameters, const Clock& clock) {
  return std::make_unique<CanWire>(std::move(bus), electronics, parameters, clock);
}

}  // namespace tankrig::sim
