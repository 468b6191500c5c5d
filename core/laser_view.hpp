// What a camera sees of the laser's sheet.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/camera_model.hpp"

namespace tankrig {

/// Depth of the nearest point of `cPl` within the image [m]; nothing if none is in front of the camera.
std::optional<double> nearest_seen(const CameraModel& camera, const Plane& cPl);

/// What is wrong with a sweep's planes together; empty if one of them comes within a tank's length of the camera in
/// its view. A single plane may be anywhere: a sweep may begin and end outside of the image.
std::string out_of_view(const CameraModel& camera, std::span<const Plane> planes);

}  // namespace tankrig
