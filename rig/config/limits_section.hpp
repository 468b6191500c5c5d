// The rig file's `scan: limits:` section: what the joints of a running arm must keep to; and the backlash of its axes.
#pragma once

#include <array>
#include <string>

#include "core/config_node.hpp"
#include "rig/safety/joint_limits.hpp"

namespace tankrig {

/// Takes from `scan`'s child `limits` what it has; what it lacks keeps its value.
/// Errors: InputError with file and line.
void read_limits_section(const ConfigNode& scan, JointLimits& limits);

/// `arm`'s list `backlash_ticks`, where it is there.
/// Errors: InputError with file and line.
void read_backlash(const ConfigNode& arm, std::array<double, kJoints>& play_ticks);

std::string backlash_yaml(const std::array<double, kJoints>& play_ticks);

/// The section's lines, indented by two blanks.
std::string limits_section_yaml(const JointLimits& limits);

}  // namespace tankrig
