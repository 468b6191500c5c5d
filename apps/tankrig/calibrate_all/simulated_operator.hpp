// Who clicks the object's corners where the tank is simulated.
#pragma once

#include <filesystem>

#include "calibration/object_pose/object_shape.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

/// Writes corners.yaml: the corners of the object's bounding box that the camera sees, as somebody clicks them who errs
/// by `sigma_px` in x and in y.
/// Errors: InputError if fewer than four are in view.
void click_corners(const sim::TankWorld& tank, const std::string& camera, const ObjectShape& shape, double sigma_px,
                   std::uint64_t seed, const std::filesystem::path& file);

}  // namespace tankrig::app
