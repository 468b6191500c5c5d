// What is painted on a surface: procedural, in the surface's own coordinates, the same in every run.
#pragma once

#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {

/// Albedo at `p` [m] of a surface with the unit normal `normal`, both in the object's own frame.
/// Stays within [0.15, 2.5] times the material's mean albedo, and below 0.95.
Rgb texture_albedo(const Material& material, const Eigen::Vector3f& p, const Eigen::Vector3f& normal);

}  // namespace tankrig::sim
