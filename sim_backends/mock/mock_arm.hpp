// The manipulator of the simulated rig: actuators with lag and dead zone, encoders with ticks, a wire with latency.
#pragma once

#include <array>
#include <mutex>
#include <vector>

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "sim_backends/mock/mock_parameters.hpp"

namespace tankrig::sim {

/// What may be wrong with it, for tests: set by the thread that owns the arm.
struct MockArmFaults {
  bool stop_fails = false;  ///< stop() is refused with kIo and changes nothing
  bool runs_away = false;   ///< set-points and stop() succeed and change nothing; the watchdog sleeps
};

/// Every exchange_period the carrier takes the last set-point to the actuators and reads the encoders. In between each
/// actuator's speed [ticks/s] follows its set-point with a first-order lag, integrated exactly.
/// Threads: any; a mutex guards the memory.  RT: the Arm interface never allocates; it blocks only while another thread
/// is inside.
class MockArm final : public Arm {
 public:
  /// Powers on at clock.now(), at rest in posture `q`, which is moved into the limits.
  MockArm(const ArmModel& model, const MockArmParameters& parameters, const JointVector& q, const Clock& clock);

  Result<std::optional<JointState>> try_read() noexcept override;
  Result<JointVector> write_velocity(const JointVector& velocity) noexcept override;
  Status stop() noexcept override;
  Duration exchange_period() const noexcept override { return parameters_.exchange_period; }

  MockArmFaults faults;

  /// Where the links really are at `when`, exactly. Remembers the last kHistory exchanges; older is answered with the
  /// oldest.
  JointVector truth_at(Stamp when) noexcept;
  /// Velocity of the links at `when`, without backlash [rad/s].
  JointVector true_velocity_at(Stamp when) noexcept;

 private:
  static constexpr std::int64_t kHistory = 4096;
  static constexpr std::size_t kInFlight = 256;  // feedback on the wire

  /// One axis between two exchanges.
  struct Axis {
    double ticks = 0, speed = 0;  ///< of the encoder's side, at the begin [ticks, ticks/s]
    double demand = 0;            ///< [ticks/s]
    double link = 0;              ///< of the link's side, behind the backlash [ticks]
  };
  using Axes = std::array<Axis, kJoints>;

  Axis axis_after(std::size_t joint, const Axis& begin, double t) const noexcept;
  Stamp exchange_stamp(std::int64_t n) const noexcept { return epoch_ + parameters_.exchange_period * n; }
  const Axes& axes(std::int64_t n) const noexcept { return history_[static_cast<std::size_t>(n % kHistory)]; }
  /// The exchange at or before `when`, of those remembered.
  std::int64_t exchange_before(Stamp when) noexcept;
  void advance(Stamp now) noexcept;
  void exchange(std::int64_t n) noexcept;
  double slope(std::size_t joint, double ticks) const noexcept;  // dq/dticks [rad/tick]

  const ArmModel model_;
  const MockArmParameters parameters_;
  const Clock& clock_;
  mutable std::mutex mutex_;  // guards what follows
  Stamp epoch_;
  std::array<double, kJoints> min_ticks_{}, max_ticks_{};
  std::vector<Axes> history_;
  std::int64_t last_ = 0;  // newest exchange
  std::array<double, kJoints> demand_{};
  Stamp written_{};
  std::array<JointState, kInFlight> feedback_{};
  std::int64_t sampled_ = 0, delivered_ = 0;  // feedback counts
};

}  // namespace tankrig::sim
