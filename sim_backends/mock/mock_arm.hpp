// The manipulator of the simulated rig: actuators with lag and dead zone, encoders with ticks, a wire with latency.
#pragma once

#include <array>
#include <atomic>
#include <mutex>

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "sim_backends/mock/mock_parameters.hpp"
#include "sim_backends/world/arm_plant.hpp"

namespace tankrig::sim {

/// Its possible faults, for tests. Any thread may set them.
struct MockArmFaults {
  std::atomic<bool> stop_fails = false;  ///< stop() is refused with kIo and changes nothing
  std::atomic<bool> runs_away = false;   ///< set-points and stop() succeed and change nothing; the watchdog sleeps
};

/// Every exchange_period the carrier takes the last set-point to the actuators and reads the encoders. In between, each
/// actuator's speed [ticks/s] follows its set-point with a first-order lag, integrated exactly. A set-point is what the
/// wire can carry: whole ticks/s, none with the low byte 0x0A.
/// Threads: any; a mutex guards the memory.
/// RT: the Arm interface never allocates; it blocks only while another thread is inside.
class MockArm final : public Arm {
 public:
  /// Powers on at clock.now(), at rest in posture `q`, clamped to the limits.
  MockArm(const ArmModel& model, const MockArmParameters& parameters, const JointVector& q, const Clock& clock);

  Result<std::optional<JointState>> try_read() noexcept override;
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& velocity) noexcept override;
  Status stop() noexcept override;
  void last_resort() noexcept override {}  ///< it dies with the process
  Duration exchange_period() const noexcept override { return parameters_.exchange_period; }

  MockArmFaults faults;

  /// Exact position of the links at `when`. Remembers the last ArmPlant::kHistory exchanges; for earlier times it gives
  /// the oldest.
  JointVector truth_at(Stamp when) noexcept;
  /// Velocity of the links at `when`, without backlash [rad/s].
  JointVector true_velocity_at(Stamp when) noexcept;

 private:
  static constexpr std::size_t kInFlight = 256;  // feedback on the wire

  Stamp exchange_stamp(std::int64_t n) const noexcept { return epoch_ + parameters_.exchange_period * n; }
  void advance(Stamp now) noexcept;
  void exchange(std::int64_t n) noexcept;

  const ArmModel model_;
  const MockArmParameters parameters_;
  const Clock& clock_;
  mutable std::mutex mutex_;  // guards what follows
  Stamp epoch_;
  ArmPlant plant_;
  std::int64_t last_ = 0;  // newest exchange
  std::array<double, kJoints> demand_{};
  Stamp written_{};
  std::array<JointState, kInFlight> feedback_{};
  std::int64_t sampled_ = 0, delivered_ = 0;  // feedback counts
};

}  // namespace tankrig::sim
