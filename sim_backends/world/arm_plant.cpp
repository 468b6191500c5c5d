#include "sim_backends/world/arm_plant.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/arm/velocity_demand.hpp"

namespace tankrig::sim {
namespace {

constexpr double kStandstill = 1e-3;  // below it an axis asked to rest is at rest [ticks/s]

}  // namespace

ArmPlant::ArmPlant(const ArmModel& model, const ArmPlantParameters& parameters, const JointVector& q, Stamp start)
    : model_(model), parameters_(parameters), history_(kHistory) {
  history_[0].when = start;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double a = model_.actuators[j].ticks(model_.limits[j].lower),
                 b = model_.actuators[j].ticks(model_.limits[j].upper);
    min_ticks_[j] = std::min(a, b);
    max_ticks_[j] = std::max(a, b);
    const double ticks = model_.actuators[j].ticks(q[static_cast<int>(j)]);
    Axis& axis = history_[0].axes[j];
    axis.ticks = axis.link = std::clamp(ticks, min_ticks_[j], max_ticks_[j]);
  }
}

ArmPlant::Axis ArmPlant::axis_after(std::size_t joint, const Axis& begin, double t) const noexcept {
  const double decay = std::exp(-t / parameters_.time_constant);
  const double excess = begin.speed - begin.demand;
  Axis end = begin;
  end.ticks += begin.demand * t + excess * parameters_.time_constant * (1 - decay);
  end.speed = begin.demand + excess * decay;
  end.stalled = 0;
  if (end.ticks <= min_ticks_[joint] || end.ticks >= max_ticks_[joint]) {
    const bool pushing = end.ticks <= min_ticks_[joint] ? begin.demand < 0 : begin.demand > 0;
    if (pushing) end.stalled = begin.stalled + t;
    end.ticks = std::clamp(end.ticks, min_ticks_[joint], max_ticks_[joint]);
    end.speed = 0;
  }
  if (begin.demand == 0 && std::abs(end.speed) < kStandstill) end.speed = 0;
  const double half = 0.5 * parameters_.backlash_ticks[joint];
  end.link = std::clamp(begin.link, end.ticks - half, end.ticks + half);
  return end;
}

ArmPlant::Axes ArmPlant::axes_after(const Knot& begin, Stamp when) const noexcept {
  const double t = std::max(0.0, seconds(when - begin.when));
  Axes axes;
  for (std::size_t j = 0; j < kJoints; ++j) axes[j] = axis_after(j, begin.axes[j], t);
  return axes;
}

/// The newest knot at or before `when`, or the oldest there is.
const ArmPlant::Knot& ArmPlant::knot_before(Stamp when) const noexcept {
  std::int64_t low = std::max<std::int64_t>(0, last_ - kHistory + 1), high = last_;
  while (low < high) {
    const std::int64_t middle = (low + high + 1) / 2;
    if (knot(middle).when <= when)
      low = middle;
    else
      high = middle - 1;
  }
  return knot(low);
}

void ArmPlant::drive(Stamp when, const std::array<double, kJoints>& ticks_per_s) noexcept {
  const std::lock_guard lock(mutex_);
  const Knot& before = knot(last_);
  Knot next{std::max(when, before.when), axes_after(before, when)};
  for (std::size_t j = 0; j < kJoints; ++j)
    next.axes[j].demand =
        std::abs(ticks_per_s[j]) < parameters_.stiction_ticks_per_s[j] ? 0 : parameters_.speed_gain[j] * ticks_per_s[j];
  history_[static_cast<std::size_t>(++last_ % kHistory)] = next;
}

ArmPlant::Axes ArmPlant::axes_at(Stamp when) const noexcept {
  const std::lock_guard lock(mutex_);
  return axes_after(knot_before(when), when);
}

ArmPlant::Axes ArmPlant::newest() const noexcept {
  const std::lock_guard lock(mutex_);
  return knot(last_).axes;
}

JointVector ArmPlant::truth_at(Stamp when) const noexcept {
  const Axes axes = axes_at(when);
  JointVector q;
  for (std::size_t j = 0; j < kJoints; ++j) q[static_cast<int>(j)] = model_.actuators[j].angle(axes[j].link);
  return q;
}

JointVector ArmPlant::true_velocity_at(Stamp when) const noexcept {
  const Axes axes = axes_at(when);
  JointVector velocity;
  for (std::size_t j = 0; j < kJoints; ++j)
    velocity[static_cast<int>(j)] = axes[j].speed * signed_slope(model_.actuators[j], axes[j].ticks);
  return velocity;
}

double ArmPlant::current_at(Stamp when) const noexcept {
  double current = parameters_.quiescent_a;
  for (const Axis& axis : axes_at(when)) {
    current += parameters_.current_a_per_tick_s * std::abs(axis.speed);
    if (axis.stalled > 0) current += parameters_.stall_a * (1 - std::exp(-axis.stalled / parameters_.stall_rise));
  }
  return current;
}

}  // namespace tankrig::sim
