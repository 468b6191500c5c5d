// The rig's models as YAML, the same in rig files and in sessions: arm, camera, pose, plane.
#pragma once

#include <string>

#include "core/arm_model.hpp"
#include "core/camera_model.hpp"
#include "core/config_node.hpp"

namespace tankrig {

/// "{translation_m: [x, y, z], quaternion_xyzw: [x, y, z, w]}"
std::string yaml_of(const Transform& aMb);
/// "{normal: [x, y, z], offset_m: d}"
std::string yaml_of(const Plane& plane);
/// "[x, y, z]"
std::string yaml_of(const Vector3d& v);
std::string yaml_of(const JointVector& q);
/// "{width_px: ..., height_px: ..., fx_px: ..., ..., k3: ...}"
std::string yaml_of(const CameraModel& camera);
/// Lines dh, limits_rad and actuators, each indented by `indent` blanks.
std::string yaml_of(const ArmModel& arm, int indent);

/// Errors: InputError with file and line, from all of them. A normal is scaled to length one.
Vector3d read_vector(const ConfigNode& node, std::string_view key);
JointVector read_joints(const ConfigNode& node, std::string_view key);
Plane read_plane(const ConfigNode& node);
CameraModel read_camera_model(const ConfigNode& node);
ArmModel read_arm_model(const ConfigNode& node);

}  // namespace tankrig
