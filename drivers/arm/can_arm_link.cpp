#include "drivers/arm/can_arm_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <set>

#include "core/settings_table.hpp"
#include "core/shown_text.hpp"
#include "drivers/can/can_timing.hpp"

namespace tankrig {
namespace {

constexpr int kFastSlots = 3;
constexpr std::uint8_t kMasterLength = 3;

Duration frame_time(const CanFrame& frame, int bitrate) noexcept {
  can_frame raw{};
  raw.can_id = frame.id;
  raw.can_dlc = frame.length;
  std::copy(frame.data.begin(), frame.data.end(), raw.data);
  return bits_duration(frame_bits(raw), bitrate);
}

}  // namespace

std::vector<CanFilter> ArmCanIds::arm_filters() const {
  std::vector<CanFilter> filters{{master}};
  for (const auto* ids : {&sensors, &pid_answer, &demand_echo})
    for (const std::uint16_t id : *ids) filters.push_back({id});
  return filters;
}

std::vector<CanFilter> ArmCanIds::host_filters() const {
  std::vector<CanFilter> filters;
  for (const auto* ids : {&demand, &pid})
    for (const std::uint16_t id : *ids) filters.push_back({id});
  return filters;
}

namespace {

std::uint16_t read_can_id(const ConfigNode& node, const char* key, const std::string& text) {
  char* end = nullptr;
  const unsigned long id = std::strtoul(text.c_str(), &end, 0);
  if (text.empty() || *end != 0 || id > 0x7FF)
    node.fail(key, "found " + shown_text(text) + ", expected an identifier of 11 bits: 0 .. 0x7FF");
  return static_cast<std::uint16_t>(id);
}

std::string can_id_text(std::uint16_t id) {
  char text[8];
  std::snprintf(text, sizeof text, "0x%03X", id);
  return text;
}

using JointIds = std::array<std::uint16_t, kJoints>;
template <JointIds ArmCanIds::*ids>
Setting<ArmCanIds> ids_setting(const char* key, const char* meaning) {
  return {key,
          {[](const ConfigNode& node, const char* at, ArmCanIds& all) {
             const auto values = node.texts(at);
             if (values.size() != kJoints)
               node.fail(at,
                         "found " + std::to_string(values.size()) + " identifiers, expected one for each of 5 joints");
             for (std::size_t j = 0; j < kJoints; ++j) (all.*ids)[j] = read_can_id(node, at, values[j]);
           },
           [](YAML::Emitter& out, const ArmCanIds& all) {
             out << YAML::Flow << YAML::BeginSeq;
             for (const std::uint16_t id : all.*ids) out << can_id_text(id);
             out << YAML::EndSeq;
           },
           "five of 0 to 0x7FF"},
          meaning};
}

const Setting<ArmCanIds> kArmCanIdRows[] = {
    ids_setting<&ArmCanIds::demand>("demand", "host to arm: demands, in the order of the joints"),
    ids_setting<&ArmCanIds::pid>("pid", "host to arm: PID gains"),
    ids_setting<&ArmCanIds::sensors>("sensors", "arm to host"),
    ids_setting<&ArmCanIds::pid_answer>("pid_answer", "arm to host: PID gains as sent"),
    ids_setting<&ArmCanIds::demand_echo>("demand_echo", "arm to host"),
    {"master",
     {[](const ConfigNode& node, const char* key, ArmCanIds& ids) {
        ids.master = read_can_id(node, key, node.text(key));
      },
      [](YAML::Emitter& out, const ArmCanIds& ids) { out << can_id_text(ids.master); }, "0 to 0x7FF"},
     "arm to host: temperature, voltage, current"},
};

void check_ids(const ConfigNode& node, const ArmCanIds& ids) {
  std::set<std::uint16_t> seen;
  const auto unique = [&](const char* key, std::uint16_t id) {
    if (!seen.insert(id).second)
      node.fail(node.has(key) ? key : node.keys().front(),
                fmt::format("found {} twice, expected every identifier once", can_id_text(id)));
  };
  const std::pair<const char*, const JointIds*> each[] = {{"demand", &ids.demand},
                                                          {"pid", &ids.pid},
                                                          {"sensors", &ids.sensors},
                                                          {"pid_answer", &ids.pid_answer},
                                                          {"demand_echo", &ids.demand_echo}};
  for (const auto& [key, of_joints] : each)
    for (const std::uint16_t id : *of_joints) unique(key, id);
  unique("master", ids.master);
}

}  // namespace

constinit const SettingsTable<ArmCanIds> kArmCanIdKeys{kArmCanIdRows, check_ids};

int can_exchange_bits(bool fast) noexcept {
  return fast ? kFastSlots * worst_frame_bits(8) : 2 * kJoints * worst_frame_bits(8) + worst_frame_bits(kMasterLength);
}

CanArmLink::CanArmLink(std::unique_ptr<CanBus> bus, const ArmCanIds& ids, int bitrate, Duration encoder_latency)
    : bus_(std::move(bus)), ids_(ids), bitrate_(bitrate), encoder_latency_(encoder_latency) {
  for (std::size_t j = 0; j < kJoints; ++j) {
    mean(ids.sensors[j], Kind::kSensors, j);
    mean(ids.pid_answer[j], Kind::kPid, j);
    mean(ids.demand_echo[j], Kind::kEcho, j);
  }
  mean(ids.master, Kind::kMaster, 0);
}

void CanArmLink::mean(std::uint16_t id, Kind kind, std::size_t joint) {
  meanings_.at(id) = {kind, static_cast<std::uint8_t>(joint)};
}

/// The demand that asks comes last: an answer to it means that the others have come too.
Status CanArmLink::try_send(const ArmDemands& demands, const ArmExchange& exchange, Stamp) noexcept {
  const bool rest = exchange.whole() && std::ranges::all_of(demands, [](const DemandSlot& demand) {
                      return demand.type == DemandType::kStop;
                    });
  if (stuck()) {
    if (!rest) return refuse_stale();
    if (rest_last_) {  // it waits there already
      note_sent(exchange);
      return {};
    }
  }
  rest_last_ = false;  // also where only a part of it is taken
  std::array<CanFrame, kJoints> frames;
  std::size_t n = 0;
  for (const bool asks : {false, true})
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (!holds(exchange.demands, j) || holds(exchange.sensors, j) != asks) continue;
      CanFrame& frame = frames[n++] = {ids_.demand[j], 8, encode(demands[j]), {}};
      if (exchange.whole()) continue;
      frame.data.back() = kActAtOnce;
      if (asks) frame.data.back() |= static_cast<std::uint8_t>(exchange.sensors | (exchange.master ? kAskMaster : 0));
    }
  const Status sent = send_all(std::span(frames).first(n), exchange);
  rest_last_ = rest && sent.ok();
  return sent;
}

Status CanArmLink::refuse_stale() noexcept {
  ++counters_.send_buffer_full;
  return Error{ErrorCode::kRefused, ENOBUFS, {}, "can: send: what was sent before still waits"};
}

Status CanArmLink::try_send(const PidSlot& gains, Stamp) noexcept {
  if (stuck()) return refuse_stale();
  rest_last_ = false;
  std::array<CanFrame, kJoints> frames;
  for (std::size_t j = 0; j < kJoints; ++j) frames[j] = {ids_.pid[j], 8, encode(gains), {}};
  return send_all(frames, {});
}

void CanArmLink::send_regardless(const ArmDemands& demands) const noexcept {
  for (std::size_t j = 0; j < kJoints; ++j) bus_->send_regardless({ids_.demand[j], 8, encode(demands[j]), {}});
}

Status CanArmLink::send_all(std::span<const CanFrame> frames, const ArmExchange& exchange) noexcept {
  unanswered_ = true;
  for (const CanFrame& frame : frames) {
    const Status sent = bus_->try_send(frame);
    if (sent.ok()) continue;
    if (sent.error().code == ErrorCode::kRefused) ++counters_.send_buffer_full;
    return sent;
  }
  note_sent(exchange);
  return {};
}

void CanArmLink::note_sent(const ArmExchange& exchange) noexcept {
  unanswered_ = true;
  if (outstanding_ == 0) forget_partial_answer();
  asked_[std::min(static_cast<std::size_t>(outstanding_), kInFlight - 1)] = exchange;
  ++outstanding_;
}

Status CanArmLink::sends() const noexcept {
  if (bus_->state() != CanState::kBusOff) return {};
  return Error{ErrorCode::kNotReady, 0, {}, "can: bus-off"};
}

const ArmExchange& CanArmLink::asked() const noexcept {
  static constexpr ArmExchange kWhole{};
  return outstanding_ > 0 ? asked_[0] : kWhole;
}

Result<std::optional<ArmAnswer>> CanArmLink::try_receive(Stamp) noexcept {
  for (;;) {
    const auto received = bus_->try_receive();
    if (!received.ok()) return received.error();
    if (!received.value()) return std::optional<ArmAnswer>{};
    const CanFrame& frame = *received.value();
    const Meaning meaning = meanings_[frame.id & 0x7FFU];
    if (meaning.kind == Kind::kUnknown) {
      ++counters_.wrong_ids;
      continue;
    }
    if (frame.length != (meaning.kind == Kind::kMaster ? kMasterLength : 8)) {
      ++counters_.wrong_lengths;
      continue;
    }
    if (!take(frame, meaning)) continue;
    ++counters_.answers;
    unanswered_ = false;
    if (outstanding_ > 0) {
      std::shift_left(asked_.begin(), asked_.end(), 1);
      --outstanding_;
    }
    return std::optional<ArmAnswer>(answer_);
  }
}

/// True when the frame completes an answer. The arm reads the encoders it is asked for at once, then sends without a
/// pause: each frame's arrival tells when, and the earliest is the least delayed.
bool CanArmLink::take(const CanFrame& frame, Meaning meaning) noexcept {
  const JointSet bit = only(meaning.joint);
  if (meaning.kind == Kind::kPid || meaning.kind == Kind::kEcho) {
    acknowledged_ |= bit;
    if (acknowledged_ != kEveryJoint) return false;
    acknowledged_ = 0;
    answer_.sensors = false;
    return true;
  }
  const ArmExchange& wanted = asked();
  const bool master = meaning.kind == Kind::kMaster;
  if (master ? !wanted.master : (wanted.sensors & bit) == 0) {  // late, of a request that was given up
    ++counters_.incomplete;
    return false;
  }
  const bool again = master ? burst_begun_ : (arrived_ & bit) != 0;
  if (again) ++counters_.incomplete;
  if (again || !burst_begun_) {
    burst_begun_ = true;
    master_arrived_ = false;
    arrived_ = 0;
    burst_time_ = {};
    answer_.read = frame.stamp;
  }
  burst_time_ += frame_time(frame, bitrate_);
  answer_.read = std::min(answer_.read, frame.stamp - burst_time_ - encoder_latency_);
  if (master) {
    answer_.master = {frame.data[0], frame.data[1], frame.data[2]};
    master_arrived_ = true;
  } else {
    answer_.joints[meaning.joint] = decode_sensors(frame.data);
    arrived_ |= bit;
  }
  if (arrived_ != wanted.sensors || (!wanted.whole() && wanted.master && !master_arrived_)) return false;
  arrived_ = 0;
  burst_begun_ = false;
  answer_.sensors = true;
  answer_.has = wanted;
  answer_.has.master = master_arrived_;
  return true;
}

void CanArmLink::forget() noexcept {
  outstanding_ = 0;
  forget_partial_answer();
}

Status CanArmLink::reopen() noexcept {
  const Status opened = bus_->reopen();
  if (opened.ok()) forget();
  return opened;
}

bool CanArmLink::needs_reopen() const noexcept {
  return bus_->state() == CanState::kDown || bus_->state() == CanState::kGone;
}

void CanArmLink::forget_partial_answer() noexcept {
  if (burst_begun_ || acknowledged_ != 0) ++counters_.incomplete;
  burst_begun_ = false;
  arrived_ = acknowledged_ = 0;
}

Duration CanArmLink::exchange_time() const noexcept { return bits_duration(can_exchange_bits(), bitrate_); }

ArmLinkCounters CanArmLink::counters() const noexcept {
  ArmLinkCounters all = counters_;
  const CanCounters bus = bus_->counters();
  all.reopened = bus.reopened;
  all.wrong_ids += bus.foreign;
  return all;
}

}  // namespace tankrig
