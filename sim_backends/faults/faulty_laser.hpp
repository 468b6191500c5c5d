// A laser with a plan's faults between it and its user.
#pragma once

#include "core/clock.hpp"
#include "drivers/laser/laser.hpp"
#include "sim_backends/faults/fault_script.hpp"
#include "sim_backends/mock/mock_laser.hpp"

namespace tankrig::sim {

/// Behaves as the relay's driver does, unless a fault is active: off is always accepted; a silent box is believed for
/// kBelieved, and opens by its watchdog after kWatchdog. Marks the script's origin of light, and plays the faults of
/// the beam.
/// Threads: as Laser.
/// RT: as Laser.
class FaultyLaser final : public Laser {
 public:
  static constexpr Duration kBelieved = std::chrono::milliseconds{150};
  static constexpr Duration kWatchdog = std::chrono::seconds{1};

  /// All outlive it.
  FaultyLaser(MockLaser& laser, FaultScript& script, const Clock& clock)
      : laser_(laser), script_(script), clock_(clock) {}

  void last_resort() noexcept override { laser_.last_resort(); }
  Result<LaserState> state() noexcept override;
  Duration warm_up() const noexcept override { return laser_.warm_up(); }

 private:
  Status set(bool on) noexcept override;
  const FaultSpec* active(FaultKind kind, Stamp now) const noexcept {
    return script_.active(FaultDevice::kLaser, kind, now);
  }
  /// Off, unplugged, or silent at the moment.
  bool mute(Stamp now) const noexcept;
  void play(Stamp now) noexcept;

  MockLaser& laser_;
  FaultScript& script_;
  const Clock& clock_;
  FaultDice lost_;
  bool commanded_ = false, waiting_ = false, trusted_ = true;
  std::optional<Stamp> due_;         // of a command that takes its time
  std::optional<Stamp> mute_since_;  // the box
  LaserState last_;
};

}  // namespace tankrig::sim
