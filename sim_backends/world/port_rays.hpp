// A camera's rays out of its housing: traced through both faces of the window, one after the other.
//
// Written by itself: what calibrates and reconstructs has its own model (core/flat_port.hpp), and tests compare the two.
#pragma once

#include "core/camera_model.hpp"

namespace tankrig::sim {

/// Frames: camera c. The ray that leaves c's origin along `direction` (unit), where it enters the water.
struct PortRay {
  Vector3d origin, direction;
};
PortRay through_port(const FlatPort& port, const Vector3d& direction);

}  // namespace tankrig::sim
