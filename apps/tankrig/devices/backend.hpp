// The devices of a rig, by the backend its file names: the one place that knows which backends exist.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.hpp"
#include "drivers/arm/arm5e.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/laser/relay_proof.hpp"
#include "drivers/lux/lux_meter.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/commission/deed.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/safety/step_watch.hpp"
#include "sim_backends/faults/fault_script.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// The devices of a rig that were asked for. Cameras stand in the order of RigConfig::cameras. One that was not asked
/// for must not be used.
class Backend {
 public:
  virtual ~Backend() = default;
  virtual Clock& clock() = 0;
  virtual Arm& arm() = 0;
  /// The arm's own driver, where it is one that has to be homed; else null.
  virtual Arm5e* homed_arm() { return nullptr; }
  virtual Laser& laser() = 0;
  /// Its guardian, on a rig whose devices may move and shine; else null.
  virtual StepWatch* step_watch() { return nullptr; }
  /// Why the laser could not be switched off, where it is not needed and its line cannot be opened; else empty.
  virtual std::string laser_unknown() const { return {}; }
  /// The watchdog box beside the rig; null if there is none, or nothing is to move or shine.
  virtual WatchdogBox* box() { return nullptr; }
  /// The lamp or sounder that warns before a start; null if there is none, or nothing is to move or shine.
  virtual WarningLine* warning() { return nullptr; }
  virtual std::vector<Camera*> cameras() = 0;
  virtual LuxMeter& lux_meter() = 0;
  /// Level of the laser's interlock - lid, key, door - at this moment. What cannot be read is open.
  virtual bool interlock_closed() const = 0;
  /// Whether that is read at all; false: it is wired past this program.
  virtual bool reads_interlock() const { return true; }
  /// The proof test of the laser's relay; null if it has none.
  virtual RelayProof* relay_proof() { return nullptr; }
  /// Somebody stands at an emulated tank, and does it. False: people have to.
  virtual bool does_by_hand(Deed /*deed*/) { return false; }
  /// What the user should know before the scan: parts of a scene that are not simulated, a calibration that is not the
  /// truth.
  virtual std::vector<std::string> warnings() const = 0;
  /// What makes the cameras' noise, for the session.
  virtual std::string noise() const = 0;
  /// Keeps what passes on the wire in the session from now on, where a device can: can.log.
  virtual void record_wire(const std::filesystem::path& /*session*/) {}
  /// What has passed until now is on disk when it returns.
  virtual void end_wire_record() {}
  /// What every device counted, as "DEVICE.NAME".
  virtual Statistics statistics() const { return {}; }
  /// The fault plan that is being played in this process; null if there is none.
  virtual sim::FaultScript* faults() { return nullptr; }
  /// The simulated tank; null on a real rig.
  virtual const sim::TankWorld* world() const = 0;
};

/// Which devices a command uses. The laser is opened first whatever it is, so that it is off. With arm and laser, real
/// ones have a guardian.
struct Need {
  bool arm = true;
  bool laser = true;             ///< false: what cannot be opened is a warning that its state is not known
  bool cameras = true;           ///< with the lux meter
  std::string only_camera = {};  ///< this one alone, without lux meter; empty: all
  bool lux_meter = false;        ///< without arm and cameras too
};

struct BackendOptions {
  sim::WorldOptions world = {};       ///< of what is simulated or emulated
  std::string carrier = {};           ///< of the arm: "can" or "serial"; empty: the rig file's
  std::filesystem::path faults = {};  ///< plan for what is simulated or emulated; empty: none
  Need need = {};
  std::string command = {};  ///< what the user runs, for the guardian's messages
  /// In place of TankWorld::render(), of a rig in this process.
  std::function<cv::Mat(const sim::TankWorld&, const std::string& camera, const sim::Exposure&)> render = {};
};

/// In the order of RigConfig::cameras.
std::vector<std::string> camera_names(const RigConfig& rig);

/// The end of a backend; but one that a cycle was left behind in gets the last resort, and stays.
struct EndBackend {
  void operator()(Backend* backend) const noexcept;
};
using OwnBackend = std::unique_ptr<Backend, EndBackend>;

/// Errors: InputError if the rig and its scene contradict each other, or a device cannot be opened.
OwnBackend make_backend(const RigConfig& rig, const BackendOptions& options);

std::unique_ptr<Backend> make_mock_backend(const RigConfig& rig, const BackendOptions& options);
std::unique_ptr<Backend> make_device_backend(const RigConfig& rig, const BackendOptions& options);

/// Every key of the rig file's `devices` with its default, range and meaning, as rows of a Markdown table.
std::string device_key_rows();

}  // namespace tankrig::app
