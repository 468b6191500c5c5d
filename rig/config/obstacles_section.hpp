// The rig file's `obstacles` section, and how much room a camera takes.
#pragma once

#include <string>

#include "core/config_node.hpp"
#include "rig/plan/obstacles.hpp"

namespace tankrig {

/// The whole section; cameras and object are not in it.
/// Errors: InputError with file and line.
void read_obstacles_section(const ConfigNode& node, Obstacles& obstacles);

/// The section's lines, without its name.
std::string obstacles_section_yaml(const Obstacles& obstacles);

/// Every key with its default, range and meaning, as a Markdown table: docs/reference/clearance.md.
std::string obstacles_section_table();

/// A camera's `body: {min_m, max_m}`, where it has one: two corners of its box in c.
/// Errors: InputError with file and line.
void read_camera_body(const ConfigNode& camera, Eigen::AlignedBox3d& body);

/// "{min_m: [x, y, z], max_m: [x, y, z]}"
std::string camera_body_yaml(const Eigen::AlignedBox3d& body);

}  // namespace tankrig
