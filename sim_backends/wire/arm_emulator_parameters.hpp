// How the emulated arm behaves: the rig file's `emulation: arm:` section.
#pragma once

#include <array>
#include <cstdint>

#include "core/config_node.hpp"
#include "drivers/arm/can_arm_link.hpp"
#include "sim_backends/world/arm_plant.hpp"

namespace tankrig::sim {

/// Defaults are a well-behaved arm with the documented habits (docs/reference/arm5e.md). Delays, currents and watchdog
/// are the emulator's own.
struct ArmEmulatorParameters {
  JointVector power_up = (JointVector() << 0, 0.12, 1.0, 0, 0.1).finished();  ///< posture [rad]
  std::array<int, kJoints> power_up_ticks{};  ///< what the encoders read then; the real arm's read 0
  ArmPlantParameters plant{};
  Duration watchdog = std::chrono::milliseconds(500);    ///< without a request for longer the axes rest; 0: never
  Duration turnaround = std::chrono::microseconds(200);  ///< from a request's last bit to reading the encoders
  Duration encoder_latency{};                            ///< from there to the answer's first bit
  bool can_paced = false;            ///< frames take their time though the bus does not: on a pair, or a vcan
  bool serial_paced = true;          ///< bytes take their time, which a pseudo-terminal does not
  bool needs_gains = true;           ///< no axis moves before PID gains have come
  bool mute_on_0a = true;            ///< a demand whose low byte is 0x0A makes it mute
  double mute_probability = 0;       ///< of going mute at a request, until a different one comes
  double zero_peak_probability = 0;  ///< of reading 0 from an encoder
  double supply_v = 24, temperature_c = 25;
  std::uint64_t seed = 1;
  // Of the wire: the driver's own.
  ArmCanIds can_ids{};
  int can_bitrate = 500'000;
  int serial_baud = 115'200;
};

/// Faults for tests to set while it runs.
struct ArmEmulatorFaults {
  bool silent = false;          ///< takes requests, answers none
  bool garbage = false;         ///< random bytes (or foreign frames) before every answer
  bool wrong_checksum = false;  ///< serial
  bool truncated = false;       ///< answers are cut off; on CAN the last joint's frame is missing
  bool no_master = false;       ///< CAN: the master's frame is missing
  int wavering_joint = -1;      ///< the joint whose encoder reads a tick more or less now and then
  bool stale = false;           ///< the same answer again and again
  bool wrong_ids = false;       ///< CAN: answers under other identifiers
  bool wrong_lengths = false;   ///< CAN: sensor frames of seven bytes
  Duration delay{};             ///< before every answer
  double lose = 0;              ///< probability that an answer is lost
  double speed = 1;             ///< of every axis, as a share of the demand
  double elbow_offset = 0;      ///< added to the elbow's encoder [rad]
  int water_joint = -1;         ///< the joint whose housing leaks
  double extra_current_a = 0;   ///< taken from the supply beside the motors
};

/// The rig file's `emulation: arm:`.
extern const SettingsTable<ArmEmulatorParameters> kArmEmulatorKeys;

}  // namespace tankrig::sim
