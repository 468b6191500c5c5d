// What a rig file says of a simulated tank, held against the scene it is simulated from.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/config/rig_config.hpp"
#include "sim_backends/world/scene.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// Where the rig file's calibration is not what is true in its scene: meant in a study of calibration errors, else a
/// mistake. A line each.
std::vector<std::string> calibration_errors(const RigConfig& rig, const sim::TankWorld& world);

/// The scene's camera behind one of the rig's.
/// Errors: InputError if there is none, or of another size.
const sim::CameraSpec& scene_camera(const RigConfig& rig, const RigCamera& camera, const sim::TankWorld& world);

/// The rig file's `truth`, with the seed that was asked for; nothing if the rig is as its drawings say.
/// Errors: InputError.
std::optional<sim::TrueRig> true_rig(const RigConfig& rig, const sim::WorldOptions& options);

/// The scene of a rig, with what the rig file's `truth` says.
/// Errors: InputError of either file.
sim::TankWorld load_world(const RigConfig& rig, sim::WorldOptions options);

/// What of the scene is not simulated, and where the rig file contradicts it.
std::vector<std::string> scene_warnings(const RigConfig& rig, const sim::TankWorld& world);

}  // namespace tankrig::app
