// An emulated ARM5E: its mechanics, its electronics, and one thread per wire.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "drivers/arm/arm_zero.hpp"
#include "drivers/can/can_bus.hpp"
#include "sim_backends/wire/arm_electronics.hpp"

namespace tankrig::sim {

class ArmWire;

/// Request -> answer on each carrier, paced as the real wire: a request counts when its last bit would have come, an
/// answer is written when its last bit would have left. Keeps real time.
/// Threads: any.
class ArmEmulator {
 public:
  /// Powers on at clock.now(). `clock` outlives the emulator.
  ArmEmulator(const ArmModel& model, const ArmEmulatorParameters& parameters, Clock& clock);
  /// Wires stop, in at most a few milliseconds.
  ~ArmEmulator();

  /// Answers on a bus: a kernel interface, a hub's, or the other end of a pair.
  void serve(std::unique_ptr<CanBus> bus);
  /// Answers on a pseudo-terminal that drivers open as `line`.
  /// Errors: InputError, see Pty.
  void serve(const std::filesystem::path& line);

  /// Unplugs every serial line, or plugs it in again.
  void unplug();
  void plug();

  /// Power off and on: encoders begin at 0, gains are lost, axes rest.
  void power_cycle() { electronics_.power_cycle({}); }
  /// The motors' supply alone: the electronics go on.
  void set_fed(bool fed) { electronics_.set_fed(fed); }
  void set_faults(const ArmEmulatorFaults& faults) { electronics_.set_faults(faults); }

  std::optional<Stamp> first_motion() const { return electronics_.first_motion(); }
  std::optional<Stamp> rest_since() const { return electronics_.rest_since(); }

  /// Where the links really are at `when`.
  JointVector truth_at(Stamp when) { return electronics_.truth_at(when); }
  JointVector true_velocity_at(Stamp when) { return electronics_.true_velocity_at(when); }
  /// The zero that homing should find.
  std::array<std::uint16_t, kJoints> true_zero() const { return electronics_.true_zero(); }

 private:
  const ArmEmulatorParameters parameters_;
  Clock& clock_;
  ArmElectronics electronics_;
  std::vector<std::unique_ptr<ArmWire>> wires_;  // last: their threads use what is above
};

/// The zero file that `tankrig arm home` would have left, if the arm has not moved since power-up.
ArmZero zero_as_homed(const ArmEmulator& arm, const ArmEmulatorParameters& parameters);

}  // namespace tankrig::sim
