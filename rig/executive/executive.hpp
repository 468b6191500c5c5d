// The cycle: read joints, decide safety, follow the plan, schedule the laser, write set-points, leave a record.
#pragma once

#include <atomic>
#include <limits>
#include <optional>

#include "core/spsc_ring.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "rig/executive/cycle_record.hpp"
#include "rig/executive/scan_plan.hpp"
#include "rig/safety/laser_interlock.hpp"

namespace tankrig {

/// Owns arm and laser while it lives; everybody else talks to it through its switches and its ring.
/// Threads: step() in the cycle's thread, everything else in one other.
/// RT: step is safe: it never allocates, blocks or throws.
class Executive {
 public:
  /// `ring_capacity` cycle records may wait to be read.
  Executive(const ScanPlan& plan, const ScanSettings& settings, Arm& arm, Laser& laser,
            std::size_t ring_capacity = 1024);

  /// One cycle at `now`.
  void step(Stamp now) noexcept;

  /// The plan's time 0; it must lie in the future. Until then the arm rests.
  void start(Stamp plan_zero) noexcept { plan_zero_ns_.store(plan_zero.ns, std::memory_order_release); }

  // Switches of the safety step; all off until they are set.
  void set_armed(bool on) noexcept { armed_.store(on, std::memory_order_relaxed); }
  void set_interlock(bool closed) noexcept { interlock_.store(closed, std::memory_order_relaxed); }
  /// Whoever supervises the cycle was well at `when`.
  void heartbeat(Stamp when) noexcept { heartbeat_ns_.store(when.ns, std::memory_order_relaxed); }
  /// Laser off, then arm stopped, in the next cycle; for good.
  void request_stop() noexcept { stop_.store(true, std::memory_order_relaxed); }

  /// Oldest record not yet read.
  bool try_pop(CycleRecord& record) noexcept { return ring_.try_pop(record); }
  std::uint64_t records_dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::int64_t kNotStarted = std::numeric_limits<std::int64_t>::max();

  void read_joints(CycleRecord& record) noexcept;
  void read_laser(CycleRecord& record) noexcept;
  void check_laser(const CycleRecord& record) noexcept;
  void check_following(CycleRecord& record) noexcept;
  void check_silence(const CycleRecord& record) noexcept;
  InterlockOutputs decide(const CycleRecord& record) noexcept;
  bool laser_request(const CycleRecord& record, const Segment& segment) const noexcept;
  JointVector follow(const CycleRecord& record, const Segment& segment) const noexcept;
  void act(CycleRecord& record, const InterlockOutputs& allowed) noexcept;
  void switch_laser(bool on, CycleRecord& record) noexcept;
  void make_safe(CycleRecord& record) noexcept;
  void raise(Fault fault, const Error& error = {}, int joint = -1) noexcept;

  const ScanPlan& plan_;
  const ScanSettings settings_;
  Arm& arm_;
  Laser& laser_;
  SpscRing<CycleRecord> ring_;

  std::atomic<std::int64_t> plan_zero_ns_{kNotStarted};
  std::atomic<std::int64_t> heartbeat_ns_{0};
  std::atomic<bool> armed_{false}, interlock_{false}, stop_{false};
  std::atomic<std::uint64_t> dropped_{0};

  // The cycle's own.
  std::uint64_t cycle_ = 0;
  ExecutiveState state_ = ExecutiveState::kWaiting;
  Fault fault_ = Fault::kNone;
  Error error_{};
  int fault_joint_ = -1;
  InterlockState interlock_state_{};
  std::optional<JointState> joints_;  // newest
  Stamp last_news_{};
  Stamp last_step_{};
  bool laser_on_ = false;                  // last command the driver accepted
  bool loop_closed_ = true;                // the interlock's, as the laser's device reads it where it does
  Duration laser_stray_{}, laser_dark_{};  // powered though not commanded, dark though commanded, for so long
};

}  // namespace tankrig
