// The devices of a rig in one simulated tank, each on the wire its driver expects, all in real time on one clock.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.hpp"
#include "core/config_node.hpp"
#include "sim_backends/faults/fault_plan.hpp"
#include "sim_backends/wire/arm_emulator.hpp"
#include "sim_backends/wire/box_emulator.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "sim_backends/wire/emulated_hand.hpp"
#include "sim_backends/wire/gige_camera.hpp"
#include "sim_backends/wire/lux_emulator.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "sim_backends/wire/v4l2_output.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::sim {

struct EmulatedArm {
  ArmEmulatorParameters parameters;
  std::optional<CanHubSettings> hub;  ///< a bus of our own
  std::string can_interface;          ///< an interface of the kernel's; empty: none
  std::filesystem::path line;         ///< empty: not on a serial line
  std::filesystem::path zero_file;    ///< written as homing would have; empty: the arm has not been homed
};

struct EmulatedVideoOutput {
  std::string name;  ///< of the scene's virtualCamera
  V4l2OutputSettings output;
};

/// The devices named here are emulated. Paths are absolute.
struct EmulatedTankSettings {
  std::optional<EmulatedArm> arm;
  std::vector<GigeCameraSettings> cameras;  ///< user_id: of the scene's virtualCamera
  std::vector<EmulatedVideoOutput> video_outputs;
  std::optional<RelayEmulatorSettings> laser;
  Duration laser_warm_up = std::chrono::seconds{1};
  std::optional<LuxEmulatorSettings> lux;
  std::optional<BoxEmulatorSettings> box;  ///< feeds arm and laser
  std::filesystem::path hand;              ///< socket of somebody at the lid and the stop; empty: nobody
  FaultPlan faults;                        ///< played from the moment every device answers
  std::filesystem::path truth;             ///< folder for CAMERA.csv with the truth of every exposure; empty: none
};

/// Where somebody at the tank is asked: EmulatedHand.
std::filesystem::path hand_at(const std::filesystem::path& runtime);

/// Every key of `emulation` with its default, range and meaning, as rows of a Markdown table.
std::string emulation_key_rows();

/// The emulators for the devices of a rig file, with their behaviour from its `emulation` section, if any. Lines that
/// do not begin with "runtime/" are not emulated.
/// Errors: InputError with file and line.
EmulatedTankSettings emulated_tank_settings_from(const ConfigNode& devices, const std::optional<ConfigNode>& emulation,
                                                 const TankWorld& world, const std::filesystem::path& runtime,
                                                 const HeartbeatOutput& heartbeat = {});

/// Whether cameras need loopback addresses of their own. A kernel's CAN interfaces are not visible from there.
bool needs_private_network(const ConfigNode& devices);

/// Serves from construction to destruction. The cameras see the arm's true posture and the laser's true power.
/// Threads: one; the emulators have their own.
class EmulatedTank {
 public:
  /// `world` and `clock` outlive it.
  /// Errors: InputError if a wire cannot be made or an address is taken.
  EmulatedTank(const TankWorld& world, EmulatedTankSettings settings, Clock& clock);
  ~EmulatedTank();
  EmulatedTank(const EmulatedTank&) = delete;
  EmulatedTank& operator=(const EmulatedTank&) = delete;

  /// One line per device: what it is and where.
  const std::string& description() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig::sim
