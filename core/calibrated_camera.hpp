// A camera and its pose, as rig files and sessions have them.
#pragma once

#include <string>

#include "core/camera_model.hpp"
#include "core/config_node.hpp"
#include "core/frame_record.hpp"

namespace tankrig {

struct CalibratedCamera {
  std::string name;
  CameraRole role = CameraRole::kMono;
  CameraModel model;
  Transform bMc = Transform::Identity();  ///< camera in the arm base; identity where there is no arm
  Duration time_offset{};  ///< t_camera - t_joints; taken off the stamps of its frames, in a session already
};

extern const SettingsTable<CalibratedCamera> kCalibratedCameraKeys;

}  // namespace tankrig
