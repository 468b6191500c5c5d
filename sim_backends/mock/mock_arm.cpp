#include "sim_backends/mock/mock_arm.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/arm/velocity_demand.hpp"

namespace tankrig::sim {
namespace {

ArmPlantParameters plant_parameters(const MockArmParameters& mock) {
  ArmPlantParameters plant;
  plant.time_constant = mock.time_constant;
  plant.backlash_ticks = mock.backlash_ticks;
  plant.stiction_ticks_per_s = mock.stiction_ticks_per_s;
  plant.speed_gain = mock.speed_gain;
  return plant;
}

}  // namespace

MockArm::MockArm(const ArmModel& model, const MockArmParameters& parameters, const JointVector& q, const Clock& clock)
    : model_(model),
      parameters_(parameters),
      clock_(clock),
      epoch_(clock.now()),
      plant_(model, plant_parameters(parameters), q, epoch_),
      written_(epoch_) {}

/// Exchange n: encoders are read, the waiting set-point takes effect.
void MockArm::exchange(std::int64_t n) noexcept {
  const Stamp when = exchange_stamp(n);
  const bool silent = when - written_ > parameters_.watchdog && !faults.runs_away;
  JointState& sample = feedback_[static_cast<std::size_t>(sampled_++) % kInFlight];
  sample.stamp = when;
  sample.current_a = plant_.current_at(when);
  plant_.drive(when, silent ? std::array<double, kJoints>{} : demand_);
  const ArmPlant::Axes axes = plant_.newest();
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double ticks = std::round(axes[j].ticks);
    sample.ticks[j] = static_cast<std::int32_t>(ticks);
    sample.q[static_cast<int>(j)] = model_.actuators[j].angle(ticks);
    sample.velocity[static_cast<int>(j)] = std::round(axes[j].speed) * signed_slope(model_.actuators[j], ticks);
  }
}

void MockArm::advance(Stamp now) noexcept {
  while (exchange_stamp(last_ + 1) <= now) exchange(++last_);
}

Result<std::optional<JointState>> MockArm::try_read() noexcept {
  const std::lock_guard lock(mutex_);
  const Stamp now = clock_.now();
  advance(now);
  std::optional<JointState> newest;
  delivered_ = std::max(delivered_, sampled_ - static_cast<std::int64_t>(kInFlight));
  while (delivered_ < sampled_) {
    const JointState& sample = feedback_[static_cast<std::size_t>(delivered_) % kInFlight];
    if (sample.stamp + parameters_.feedback_latency > now) break;
    newest = sample;
    ++delivered_;
  }
  if (newest && !parameters_.latency_known) newest->stamp = newest->stamp + parameters_.feedback_latency;
  return newest;
}

Result<JointVector> MockArm::write_velocity(const OutputRight& /*right*/, const JointVector& velocity) noexcept {
  const std::lock_guard lock(mutex_);
  const Stamp now = clock_.now();
  advance(now);
  if (faults.runs_away) return velocity;
  const ArmPlant::Axes axes = plant_.newest();
  std::array<double, kJoints> ticks;
  for (std::size_t j = 0; j < kJoints; ++j) ticks[j] = axes[j].ticks;
  const VelocityShaping shaping{parameters_.creep, parameters_.dead_zone, parameters_.max_ticks_per_s};
  auto demand = velocity_demand(model_, shaping, ticks, velocity);
  if (!demand) return Error{ErrorCode::kOutOfRange, 0, now, "arm: velocity is not a number"};
  make_sendable(*demand);
  demand_ = demand->ticks_per_s;
  written_ = now;
  return demand->applied;
}

Status MockArm::stop() noexcept {
  const std::lock_guard lock(mutex_);
  const Stamp now = clock_.now();
  if (faults.stop_fails) return Error{ErrorCode::kIo, 0, now, "arm: stop"};
  advance(now);
  if (!faults.runs_away) demand_.fill(0);
  written_ = now;
  return {};
}

JointVector MockArm::truth_at(Stamp when) noexcept {
  const std::lock_guard lock(mutex_);
  advance(clock_.now());
  return plant_.truth_at(when);
}

JointVector MockArm::true_velocity_at(Stamp when) noexcept {
  const std::lock_guard lock(mutex_);
  advance(clock_.now());
  return plant_.true_velocity_at(when);
}

}  // namespace tankrig::sim
