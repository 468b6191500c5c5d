// When a triggered camera exposes: at the elbow's next angle, or at the next whole period of the plan.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <optional>

#include "rig/executive/cycle_record.hpp"
#include "rig/plan/scan_plan.hpp"
#include "rig/plan/trigger_settings.hpp"

namespace tankrig {

/// One exposure asked for.
struct TriggerRequest {
  Stamp fire_at{};                                          ///< when trigger() is to be called
  Stamp middle{};                                           ///< when mid-exposure then is
  double angle = std::numeric_limits<double>::quiet_NaN();  ///< of the elbow at `middle` [rad]; none at equal times
};

/// For one camera. Mid-exposure falls on the angle or the time; trigger() is called earlier by the camera's delay.
///   kSoftware  mid-exposures at whole periods of plan time
///   kPosition  in sweeps at sweep_from + (n + pass / passes) * spacing, n whole, in either direction, from sweep_from
///              to sweep_to, both included: the crossing is predicted from the newest joint sample and its velocity; in
///              dark blocks at whole periods
/// Only while the camera records and the executive runs its plan.
/// Threads: next() in the cycle's thread, everything else from any.
/// RT: all are safe.
class TriggerSchedule {
 public:
  /// `period` of frames at equal times [s].
  TriggerSchedule(const ScanPlan& plan, const ScanSettings& settings, const TriggerSettings& trigger, RecordWhen record,
                  double period);

  /// The trigger to fire before the next cycle, if any. At most one: a camera is slower than the cycle.
  std::optional<TriggerRequest> next(const CycleRecord& record) noexcept;

  void set_delay(Duration delay) noexcept { delay_ns_.store(delay.count(), std::memory_order_relaxed); }
  /// Angles and times of the recorded part that passed before they could be requested.
  std::uint64_t skipped() const noexcept { return skipped_.load(std::memory_order_relaxed); }

 private:
  std::optional<TriggerRequest> next_time(const CycleRecord& record) noexcept;
  std::optional<TriggerRequest> next_angle(const CycleRecord& record, const Segment& sweep) noexcept;
  void leave_sweep() noexcept;
  void pass_times(double soonest) noexcept;
  bool exposed_at_time(double plan_time) const noexcept;
  double delay() const noexcept { return seconds(Duration{delay_ns_.load(std::memory_order_relaxed)}); }

  const ScanPlan& plan_;
  const TriggerSettings trigger_;
  const RecordWhen record_;
  const double period_, cycle_period_;
  const double from_, to_, side_;  // the grid's angle 0, the sweep's end, and the way to it
  const int passes_;
  std::atomic<std::int64_t> delay_ns_;
  std::atomic<std::uint64_t> skipped_{0};

  // The cycle's own.
  std::optional<JointState> joints_;                                 // newest
  std::int64_t last_period_ = -1;                                    // of those asked for or passed
  std::uint32_t sweep_ = std::numeric_limits<std::uint32_t>::max();  // segment of next_angle_
  std::int64_t next_angle_ = 0, last_angle_ = -1;                    // of that segment
};

}  // namespace tankrig
