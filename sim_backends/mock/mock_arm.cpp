#include "sim_backends/mock/mock_arm.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig::sim {
namespace {

constexpr double kStandstill = 1e-3;  // below it an axis asked to rest is at rest [ticks/s]

}  // namespace

MockArm::MockArm(const ArmModel& model, const MockArmParameters& parameters, const JointVector& q, const Clock& clock)
    : model_(model), parameters_(parameters), clock_(clock), epoch_(clock.now()), history_(kHistory), written_(epoch_) {
  Axes& begin = history_[0];
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double a = model_.actuators[j].ticks(model_.limits[j].lower),
                 b = model_.actuators[j].ticks(model_.limits[j].upper);
    min_ticks_[j] = std::min(a, b);
    max_ticks_[j] = std::max(a, b);
    const double ticks = model_.actuators[j].ticks(q[static_cast<int>(j)]);
    begin[j].ticks = begin[j].link = std::clamp(ticks, min_ticks_[j], max_ticks_[j]);
  }
}

double MockArm::slope(std::size_t joint, double ticks) const noexcept {
  const Actuator& a = model_.actuators[joint];
  return a.d == 0 ? a.rad_per_tick : a.sign * a.resolution(a.angle(ticks));
}

MockArm::Axis MockArm::axis_after(std::size_t joint, const Axis& begin, double t) const noexcept {
  const double decay = std::exp(-t / parameters_.time_constant);
  const double excess = begin.speed - begin.demand;
  Axis end = begin;
  end.ticks += begin.demand * t + excess * parameters_.time_constant * (1 - decay);
  end.speed = begin.demand + excess * decay;
  if (end.ticks <= min_ticks_[joint] || end.ticks >= max_ticks_[joint]) {
    end.ticks = std::clamp(end.ticks, min_ticks_[joint], max_ticks_[joint]);
    end.speed = 0;
  }
  if (begin.demand == 0 && std::abs(end.speed) < kStandstill) end.speed = 0;
  const double play = 0.5 * parameters_.backlash_ticks[joint];
  end.link = std::clamp(begin.link, end.ticks - play, end.ticks + play);
  return end;
}

/// Exchange n: encoders are read, the waiting set-point takes effect.
void MockArm::exchange(std::int64_t n) noexcept {
  const Stamp when = exchange_stamp(n);
  const bool silent = when - written_ > parameters_.watchdog && !faults.runs_away;
  JointState& sample = feedback_[static_cast<std::size_t>(sampled_++) % kInFlight];
  sample.stamp = when;
  Axes& next = history_[static_cast<std::size_t>(n % kHistory)];
  for (std::size_t j = 0; j < kJoints; ++j) {
    next[j] = axis_after(j, axes(n - 1)[j], seconds(parameters_.exchange_period));
    next[j].demand = silent ? 0 : demand_[j];
    const double ticks = std::round(next[j].ticks);
    sample.ticks[j] = static_cast<std::int32_t>(ticks);
    sample.q[static_cast<int>(j)] = model_.actuators[j].angle(ticks);
    sample.velocity[static_cast<int>(j)] = std::round(next[j].speed) * slope(j, ticks);
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

Result<JointVector> MockArm::write_velocity(const JointVector& velocity) noexcept {
  const std::lock_guard lock(mutex_);
  const Stamp now = clock_.now();
  advance(now);
  if (faults.runs_away) return velocity;
  double fastest = 0;
  for (std::size_t j = 0; j < kJoints; ++j) {
    double v = velocity[static_cast<int>(j)];
    if (!std::isfinite(v)) return Error{ErrorCode::kOutOfRange, 0, now, "arm: velocity is not a number"};
    const double dead_zone = parameters_.dead_zone[static_cast<int>(j)];
    if (std::abs(v) < parameters_.creep)
      v = 0;
    else if (std::abs(v) < dead_zone)
      v = std::copysign(dead_zone, v);
    demand_[j] = v / slope(j, axes(last_)[j].ticks);
    fastest = std::max(fastest, std::abs(demand_[j]));
  }
  const double scale = fastest > parameters_.max_ticks_per_s ? parameters_.max_ticks_per_s / fastest : 1;
  JointVector applied;
  for (std::size_t j = 0; j < kJoints; ++j) {
    demand_[j] = std::round(demand_[j] * scale);
    applied[static_cast<int>(j)] = demand_[j] * slope(j, axes(last_)[j].ticks);
  }
  written_ = now;
  return applied;
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

std::int64_t MockArm::exchange_before(Stamp when) noexcept {
  advance(clock_.now());
  return std::clamp((when - epoch_) / parameters_.exchange_period, std::max<std::int64_t>(0, last_ - kHistory + 1),
                    last_);
}

JointVector MockArm::truth_at(Stamp when) noexcept {
  const std::lock_guard lock(mutex_);
  const std::int64_t n = exchange_before(when);
  const double t = std::max(0.0, seconds(when - exchange_stamp(n)));
  JointVector q;
  for (std::size_t j = 0; j < kJoints; ++j)
    q[static_cast<int>(j)] = model_.actuators[j].angle(axis_after(j, axes(n)[j], t).link);
  return q;
}

JointVector MockArm::true_velocity_at(Stamp when) noexcept {
  const std::lock_guard lock(mutex_);
  const std::int64_t n = exchange_before(when);
  const double t = std::max(0.0, seconds(when - exchange_stamp(n)));
  JointVector velocity;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const Axis axis = axis_after(j, axes(n)[j], t);
    velocity[static_cast<int>(j)] = axis.speed * slope(j, axis.ticks);
  }
  return velocity;
}

}  // namespace tankrig::sim
