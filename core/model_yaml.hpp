// The rig's models as YAML, the same in rig files and in sessions: pose, plane, camera, arm.
#pragma once

#include <yaml-cpp/emitter.h>
#include <yaml-cpp/emittermanip.h>

#include <string>

#include "core/arm_model.hpp"
#include "core/camera_model.hpp"
#include "core/config_node.hpp"
#include "core/text_files.hpp"

namespace tankrig {

/// "[x, y, z]"
template <class Numbers>
void emit_list(YAML::Emitter& out, const Numbers& numbers) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const double number : numbers) out << exact_text(number);
  out << YAML::EndSeq;
}
template <class Numbers>
void emit(YAML::Emitter& out, const Numbers& numbers) {
  emit_list(out, numbers);
}
/// "{translation_m: [x, y, z], quaternion_xyzw: [x, y, z, w]}"
void emit(YAML::Emitter& out, const Transform& aMb);
/// "{normal: [x, y, z], offset_m: d}"
void emit(YAML::Emitter& out, const Plane& plane);
void emit(YAML::Emitter& out, const CameraModel& camera);
void emit(YAML::Emitter& out, const ArmModel& arm);

template <class Value>
std::string yaml_of(const Value& value) {
  YAML::Emitter out;
  emit(out, value);
  return out.c_str();
}

extern const SettingsTable<CameraModel> kCameraModelKeys;
extern const SettingsTable<ArmModel> kArmModelKeys;

/// Errors: InputError with file and line, from both. A normal is scaled to length one.
Vector3d read_vector(const ConfigNode& node, std::string_view key);
Plane read_plane(const ConfigNode& node);

/// Of a laser that the end effector carries: the plane `ePl`, and its origin under `origin_key`.
/// Errors: InputError if either is as far off as only millimetres taken for metres are.
void check_laser_reach(const ConfigNode& node, std::string_view origin_key, const Plane& ePl, const Vector3d& origin_e);

}  // namespace tankrig
