// The emulated arm behind its wire: takes requests, drives the axes, reads the encoders, with the real arm's habits.
#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <random>

#include "core/clock.hpp"
#include "drivers/arm/arm_exchange.hpp"
#include "drivers/arm/joint_slot.hpp"
#include "sim_backends/wire/arm_emulator_parameters.hpp"
#include "sim_backends/world/arm_plant.hpp"

namespace tankrig::sim {

/// Slots of joints, in the order of `Joint`.
struct ArmRequest {
  HostSlot kind = HostSlot::kDemand;
  std::array<SlotBytes, kJoints> slots{};
  JointSet joints = kEveryJoint;  ///< whose slots have come
  bool operator==(const ArmRequest&) const = default;
};

struct ArmReply {
  ArmSlot kind = ArmSlot::kSensors;
  std::array<SlotBytes, kJoints> slots{};
  MasterBytes master;
};

/// Threads: any; a mutex guards everything.
class ArmElectronics {
 public:
  /// Powers on at clock.now().
  ArmElectronics(const ArmModel& model, const ArmEmulatorParameters& parameters, const Clock& clock);

  /// A request whose last bit came at `when`, and the arm's answer.
  std::optional<ArmReply> request(const ArmRequest& request, Stamp when);

  /// Power off and on: encoders read `ticks`, gains are lost, axes rest.
  void power_cycle(const std::array<int, kJoints>& ticks);

  /// The motors' supply comes or goes: without it the axes rest, and encoders count on.
  void set_fed(bool fed);
  void set_faults(const ArmEmulatorFaults& faults);
  ArmEmulatorFaults faults() const;

  /// When a request first demanded motion; when one last brought a moving arm to rest (nothing while it moves).
  std::optional<Stamp> first_motion() const;
  std::optional<Stamp> rest_since() const;

  JointVector truth_at(Stamp when);
  JointVector true_velocity_at(Stamp when);
  /// Encoder reading at the actuators' tick 0, modulo 65536: homing should find this zero.
  std::array<std::uint16_t, kJoints> true_zero() const;

 private:
  void supervise(Stamp when);
  void obey(const ArmRequest& request, Stamp when);
  ArmReply sensors(Stamp when);

  const ArmEmulatorParameters parameters_;
  const Clock& clock_;
  const Actuator elbow_;
  ArmPlant plant_;
  mutable std::mutex mutex_;  // guards what follows
  ArmEmulatorFaults faults_;
  std::mt19937_64 random_;
  std::array<double, kJoints> encoder_base_{};      ///< actuator ticks at raw 0
  std::array<double, kJoints> demand_{}, asked_{};  // of the axes; on the wire, fed or not
  bool has_gains_ = false, fed_ = true;
  std::optional<Stamp> first_motion_, rest_since_;
  std::array<Stamp, kJoints> requested_{};
  std::optional<ArmRequest> mute_since_;
  std::optional<ArmReply> last_;
};

}  // namespace tankrig::sim
