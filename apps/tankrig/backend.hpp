// The devices of a rig, by the backend its file names: the one place that knows which backends exist.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/lux/lux_meter.hpp"
#include "rig/config/rig_config.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// Every device of a rig, ready to be scanned with. Cameras stand in the order of RigConfig::cameras.
class Backend {
 public:
  virtual ~Backend() = default;
  virtual Clock& clock() = 0;
  virtual Arm& arm() = 0;
  virtual Laser& laser() = 0;
  virtual std::vector<Camera*> cameras() = 0;
  virtual LuxMeter& lux_meter() = 0;
  /// Level of the laser's interlock - lid, key, door - at this moment. What cannot be read is open.
  virtual bool interlock_closed() const = 0;
  /// What the user should know before the scan: parts of a scene that are not simulated, a calibration that is not the
  /// truth.
  virtual std::vector<std::string> warnings() const = 0;
  /// What makes the cameras' noise, for the session.
  virtual std::string noise() const = 0;
  /// The simulated tank; null on a real rig.
  virtual const sim::TankWorld* world() const = 0;
};

/// Errors: InputError if the rig and its scene contradict each other.
std::unique_ptr<Backend> make_backend(const RigConfig& rig, const sim::WorldOptions& options);

}  // namespace tankrig::app
