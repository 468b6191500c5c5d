// An arm with a plan's faults between it and its user.
#pragma once

#include <array>

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "sim_backends/faults/fault_script.hpp"

namespace tankrig::sim {

/// Behaves as the real driver, errors included, unless a fault is active. Marks the script's origin of motion.
/// Threads: as Arm.
/// RT: as Arm.
class FaultyArm final : public Arm {
 public:
  /// All outlive it.
  FaultyArm(Arm& arm, FaultScript& script, const Clock& clock) : arm_(arm), script_(script), clock_(clock) {}

  Result<std::optional<JointState>> try_read() noexcept override;
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& velocity) noexcept override;
  Status stop() noexcept override;
  void last_resort() noexcept override { arm_.last_resort(); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }
  Statistics statistics() const override { return arm_.statistics(); }

 private:
  struct Late {
    Stamp due{};
    JointState state;
  };

  const FaultSpec* active(FaultKind kind, Stamp now) const noexcept {
    return script_.active(FaultDevice::kArm, kind, now);
  }
  bool mute(Stamp now) const noexcept;
  void spoil(JointState& state, Stamp now) noexcept;
  std::optional<JointState> delayed(std::optional<JointState> news, Stamp now) noexcept;

  Arm& arm_;
  FaultScript& script_;
  const Clock& clock_;
  FaultDice lost_, noise_;
  std::optional<JointState> last_;  // as the arm reported it
  std::optional<JointState> stuck_;
  std::array<Late, 256> late_{};
  std::size_t late_first_ = 0, late_count_ = 0;
};

}  // namespace tankrig::sim
