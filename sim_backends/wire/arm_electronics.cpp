#include "sim_backends/wire/arm_electronics.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/arm/velocity_demand.hpp"

namespace tankrig::sim {
namespace {

constexpr ArmScaling kScaling = laboratory_scaling();
constexpr std::uint8_t kWet = 0xC8;

std::uint8_t raw(double value, double per_count, double offset = 0) {
  return static_cast<std::uint8_t>(std::clamp(std::lround((value - offset) / per_count), 0L, 255L));
}

std::uint16_t wrapped(double ticks) {
  return static_cast<std::uint16_t>(static_cast<std::int64_t>(std::lround(ticks)));
}

}  // namespace

ArmElectronics::ArmElectronics(const ArmModel& model, const ArmEmulatorParameters& parameters, const Clock& clock)
    : parameters_(parameters),
      clock_(clock),
      elbow_(model.actuators[kElbow]),
      plant_(model, parameters.plant, parameters.power_up, clock.now()),
      random_(parameters.seed) {
  power_cycle(parameters.power_up_ticks);
}

void ArmElectronics::power_cycle(const std::array<int, kJoints>& ticks) {
  const std::lock_guard lock(mutex_);
  const Stamp now = clock_.now();
  const ArmPlant::Axes axes = plant_.axes_at(now);
  demand_.fill(0);
  asked_.fill(0);
  plant_.drive(now, demand_);
  for (std::size_t j = 0; j < kJoints; ++j) encoder_base_[j] = std::round(axes[j].ticks) - ticks[j];
  has_gains_ = false;
  mute_since_.reset();
  last_.reset();
  requested_.fill(now);
}

void ArmElectronics::set_fed(bool fed) {
  const std::lock_guard lock(mutex_);
  fed_ = fed;
  if (fed) return;
  const Stamp now = clock_.now();
  supervise(now);
  demand_.fill(0);
  plant_.drive(now, demand_);
}

void ArmElectronics::set_faults(const ArmEmulatorFaults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

ArmEmulatorFaults ArmElectronics::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

/// Its own watchdog: a joint rests when no request for it has come for too long.
void ArmElectronics::supervise(Stamp when) {
  if (parameters_.watchdog.count() == 0) return;
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (demand_[j] == 0 || when - requested_[j] <= parameters_.watchdog) continue;
    demand_[j] = asked_[j] = 0;
    plant_.drive(requested_[j] + parameters_.watchdog, demand_);
  }
}

std::optional<ArmReply> ArmElectronics::request(const ArmRequest& request, Stamp when) {
  const std::lock_guard lock(mutex_);
  supervise(when);
  if (mute_since_ && *mute_since_ == request) return {};
  mute_since_.reset();
  for (std::size_t j = 0; j < kJoints; ++j)
    if (holds(request.joints, j)) requested_[j] = when;
  const bool has_0a = request.kind == HostSlot::kDemand &&
                      std::any_of(request.slots.begin(), request.slots.end(),
                                  [](const SlotBytes& slot) { return (decode_demand(slot).demand & 0xFF) == 0x0A; });
  std::bernoulli_distribution falls_mute(parameters_.mute_probability);
  if ((has_0a && parameters_.mute_on_0a) || falls_mute(random_)) {
    mute_since_ = request;
    return {};
  }
  const Stamp read = when + parameters_.turnaround;
  std::optional<ArmReply> reply;
  if (request.kind == HostSlot::kPid) {
    has_gains_ = true;
    reply = sensors(read);
    reply->kind = ArmSlot::kPid;
    reply->slots = request.slots;
  } else {
    obey(request, when);
    reply = faults_.stale && last_ ? *last_ : sensors(read);
    last_ = reply;
  }
  if (faults_.silent || (faults_.lose > 0 && std::bernoulli_distribution(faults_.lose)(random_))) return {};
  return reply;
}

/// Only rest and the speed demands do something: position control does not work in the real arm either.
void ArmElectronics::obey(const ArmRequest& request, Stamp when) {
  for (std::size_t j = 0; j < kJoints; ++j) {
    if (!holds(request.joints, j)) continue;
    const DemandSlot slot = decode_demand(request.slots[j]);
    const double speed = std::min({slot.demand, slot.speed_limit, kLargestSpeed});
    const bool able = (has_gains_ || !parameters_.needs_gains) && slot.current_limit != 0;
    asked_[j] = 0;
    if (able && slot.type == DemandType::kSpeedForward) asked_[j] = faults_.speed * speed;
    if (able && slot.type == DemandType::kSpeedBackward) asked_[j] = -faults_.speed * speed;
    demand_[j] = fed_ ? asked_[j] : 0;
  }
  const auto moves = [](double v) { return v != 0; };
  if (!first_motion_ && std::any_of(demand_.begin(), demand_.end(), moves)) first_motion_ = when;
  if (std::any_of(asked_.begin(), asked_.end(), moves)) {
    rest_since_.reset();
  } else if (first_motion_ && !rest_since_) {
    rest_since_ = when;
  }
  plant_.drive(when, demand_);
}

ArmReply ArmElectronics::sensors(Stamp when) {
  const ArmPlant::Axes axes = plant_.axes_at(when);
  std::bernoulli_distribution peaks(parameters_.zero_peak_probability);
  ArmReply reply;
  for (std::size_t j = 0; j < kJoints; ++j) {
    SensorSlot slot;
    const double offset =
        j == kElbow && faults_.elbow_offset != 0 ? faults_.elbow_offset / signed_slope(elbow_, axes[j].ticks) : 0;
    const int waver = faults_.wavering_joint == static_cast<int>(j) ? std::uniform_int_distribution(-1, 1)(random_) : 0;
    slot.position = peaks(random_) ? 0 : wrapped(std::round(axes[j].ticks + offset) - encoder_base_[j] + waver);
    slot.speed = wrapped(axes[j].speed);
    slot.water_ingress = faults_.water_joint == static_cast<int>(j) ? kWet : 0;
    slot.temperature = raw(parameters_.temperature_c, kScaling.celsius_per_count);
    const double stalled = axes[j].stalled > 0 ? parameters_.plant.stall_a : 0;
    slot.tail = raw(stalled, kScaling.ampere_per_count, kScaling.ampere_offset);
    reply.slots[j] = encode(slot);
  }
  reply.master.temperature = raw(parameters_.temperature_c, kScaling.celsius_per_count);
  reply.master.voltage = raw(parameters_.supply_v, kScaling.volt_per_count);
  reply.master.current =
      raw(plant_.current_at(when) + faults_.extra_current_a, kScaling.ampere_per_count, kScaling.ampere_offset);
  return reply;
}

std::optional<Stamp> ArmElectronics::first_motion() const {
  const std::lock_guard lock(mutex_);
  return first_motion_;
}

std::optional<Stamp> ArmElectronics::rest_since() const {
  const std::lock_guard lock(mutex_);
  return rest_since_;
}

JointVector ArmElectronics::truth_at(Stamp when) {
  const std::lock_guard lock(mutex_);
  supervise(clock_.now());
  return plant_.truth_at(when);
}

JointVector ArmElectronics::true_velocity_at(Stamp when) {
  const std::lock_guard lock(mutex_);
  supervise(clock_.now());
  return plant_.true_velocity_at(when);
}

std::array<std::uint16_t, kJoints> ArmElectronics::true_zero() const {
  const std::lock_guard lock(mutex_);
  std::array<std::uint16_t, kJoints> zero;
  for (std::size_t j = 0; j < kJoints; ++j) zero[j] = wrapped(-encoder_base_[j]);
  return zero;
}

}  // namespace tankrig::sim
