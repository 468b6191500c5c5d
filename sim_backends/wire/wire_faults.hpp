// Plays a fault plan on emulated devices, at the level of their wires.
#pragma once

#include <atomic>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "sim_backends/faults/fault_script.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/wire/arm_emulator.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "sim_backends/wire/gige_camera.hpp"
#include "sim_backends/wire/lux_emulator.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "sim_backends/wire/v4l2_output.hpp"

namespace tankrig::sim {

/// The devices; null or empty if absent. The arm's node on the hub is the first that connected.
struct WireDevices {
  ArmEmulator* arm = nullptr;
  CanHub* hub = nullptr;
  MockLaser* laser = nullptr;  ///< whose light the cameras see
  RelayEmulator* relay = nullptr;
  LuxEmulator* lux = nullptr;
  std::map<std::string, GigeCameraEmulator*> cameras;
  std::map<std::string, V4l2OutputEmulator*> outputs;
};

/// Switches faults on and off within a few milliseconds of their time. Motion and light count from when the emulators
/// see them. Whoever makes pictures or lux readings asks for their faults: PictureFaults, spoilt_lux(). A fault of an
/// absent device does nothing.
/// Threads: its own calls the emulators; the destructor ends it after the current switching.
class WireFaults {
 public:
  /// All outlive it.
  WireFaults(FaultScript& script, WireDevices devices);
  ~WireFaults();
  WireFaults(const WireFaults&) = delete;
  WireFaults& operator=(const WireFaults&) = delete;

 private:
  void run();
  void mark();
  void play_arm(Stamp now);
  void play_bus(Stamp now);
  void play_laser(Stamp now);
  void play_lux(Stamp now);
  void play_cameras(Stamp now);
  bool on(FaultDevice device, FaultKind kind, Stamp now, std::string_view camera = {}) const {
    return script_.active(device, kind, now, camera) != nullptr;
  }
  /// True once for every change of `what`.
  bool changed(const std::string& what, double value);
  /// The device's plug; true once for every change.
  template <class Device>
  bool pull(Device& device, const std::string& name, bool pulled) {
    if (!changed(name + " unplugged", pulled)) return false;
    pulled ? device.unplug() : device.plug();
    return true;
  }

  FaultScript& script_;
  const WireDevices devices_;
  std::map<std::string, double> applied_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

/// The lux meter's reading under the plan; `last`: its own memory.
double spoilt_lux(const FaultScript& script, double lux, Stamp now, double& last);

}  // namespace tankrig::sim
