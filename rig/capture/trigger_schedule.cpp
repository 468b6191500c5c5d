#include "rig/capture/trigger_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tankrig {
namespace {

constexpr double kMoving = 0.2;  // of the sweep's velocity: below it the elbow stands, and no crossing can be foretold
constexpr double kOnTheEdge = 1e-6;  // of a spacing: the sweep's own ends are angles of it

}  // namespace

TriggerSchedule::TriggerSchedule(const ScanPlan& plan, const ScanSettings& settings, const TriggerSettings& trigger,
                                 RecordWhen record, double period)
    : plan_(plan),
      trigger_(trigger),
      record_(record),
      period_(period),
      cycle_period_(1 / settings.cycle_hz),
      from_(settings.sweep.from),
      to_(settings.sweep.to),
      side_(settings.sweep.to > settings.sweep.from ? 1 : -1),
      passes_(settings.sweep.passes),
      delay_ns_(trigger.delay.value_or(Duration{0}).count()) {}

bool TriggerSchedule::exposed_at_time(double plan_time) const noexcept {
  const Segment& s = plan_.segments()[plan_.segment_at(plan_time)];
  if (s.phase == Phase::kMove || plan_time < s.record_begin || plan_time > s.record_end) return false;
  if (s.phase != Phase::kSweep) return record_ != RecordWhen::kSweep;
  return record_ != RecordWhen::kDark && trigger_.mode != TriggerMode::kPosition;
}

std::optional<TriggerRequest> TriggerSchedule::next(const CycleRecord& record) noexcept {
  if (record.has_joints) joints_ = record.joints;
  if (record.state != ExecutiveState::kRunning) return std::nullopt;
  const Segment& segment = plan_.segments()[plan_.segment_at(record.plan_time + delay())];
  const auto number = static_cast<std::uint32_t>(&segment - plan_.segments().data());
  if (number != sweep_) leave_sweep();
  pass_times(record.plan_time + delay());
  if (trigger_.mode == TriggerMode::kPosition && segment.phase == Phase::kSweep) return next_angle(record, segment);
  return next_time(record);
}

/// Angles that its sweep did not come to.
void TriggerSchedule::leave_sweep() noexcept {
  skipped_.fetch_add(static_cast<std::uint64_t>(std::max<std::int64_t>(0, last_angle_ + 1 - next_angle_)),
                     std::memory_order_relaxed);
  next_angle_ = last_angle_ + 1;
}

/// Whole periods before `soonest` that nobody asked for.
void TriggerSchedule::pass_times(double soonest) noexcept {
  const auto due = static_cast<std::int64_t>(std::ceil(soonest / period_ - 1e-9));
  for (; last_period_ + 1 < due; ++last_period_)
    if (exposed_at_time(static_cast<double>(last_period_ + 1) * period_))
      skipped_.fetch_add(1, std::memory_order_relaxed);
}

std::optional<TriggerRequest> TriggerSchedule::next_time(const CycleRecord& record) noexcept {
  const double middle = static_cast<double>(last_period_ + 1) * period_;
  if (middle - delay() >= record.plan_time + cycle_period_) return std::nullopt;
  ++last_period_;
  if (!exposed_at_time(middle)) return std::nullopt;
  const Stamp when = record.stamp + from_seconds(middle - record.plan_time);
  return TriggerRequest{when - from_seconds(delay()), when, std::numeric_limits<double>::quiet_NaN()};
}

std::optional<TriggerRequest> TriggerSchedule::next_angle(const CycleRecord& record, const Segment& sweep) noexcept {
  const double way = sweep.motion.to()[kElbow] - sweep.motion.from()[kElbow];
  const double planned = plan_.at(record.plan_time).velocity[kElbow];
  if (record_ == RecordWhen::kDark || !joints_ || !(joints_->velocity[kElbow] * way > 0) ||
      std::abs(joints_->velocity[kElbow]) < kMoving * std::abs(planned))
    return std::nullopt;

  // Angles counted in spacings from this pass's grid, growing along its way.
  const double direction = way > 0 ? 1 : -1;
  const double origin = from_ + side_ * trigger_.spacing * sweep.pass / passes_;
  const auto counted = [&](double angle) { return direction * (angle - origin) / trigger_.spacing; };
  const auto first = static_cast<std::int64_t>(std::ceil(std::min(counted(from_), counted(to_)) - kOnTheEdge));
  const auto last = static_cast<std::int64_t>(std::floor(std::max(counted(from_), counted(to_)) + kOnTheEdge));
  const auto number = static_cast<std::uint32_t>(&sweep - plan_.segments().data());
  if (std::exchange(sweep_, number) != number) next_angle_ = first, last_angle_ = last;
  if (next_angle_ > last) return std::nullopt;

  const double q = counted(joints_->q[kElbow]);
  const double speed = direction * joints_->velocity[kElbow] / trigger_.spacing;  // spacings per second
  const double soonest = seconds(record.stamp - joints_->stamp) + delay();        // after the sample
  // An angle that was not due by the last sample and is passed by this one comes late by less than a cycle.
  const double due = q + speed * (soonest - cycle_period_);
  const std::int64_t n = std::max(static_cast<std::int64_t>(std::ceil(due)), next_angle_);
  const double after = (static_cast<double>(n) - q) / speed;  // of the sample
  if (after - soonest >= cycle_period_) return std::nullopt;
  skipped_.fetch_add(static_cast<std::uint64_t>(std::min(n, last + 1) - next_angle_), std::memory_order_relaxed);
  next_angle_ = n + 1;
  if (n > last) return std::nullopt;
  const Stamp when = joints_->stamp + from_seconds(after);
  return TriggerRequest{when - from_seconds(delay()), when,
                        origin + direction * static_cast<double>(n) * trigger_.spacing};
}

}  // namespace tankrig
