// A hand-eye data folder: hand_eye.yaml, and the pictures or poses it names. Layouts: docs/reference/formats.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/marker/marker.hpp"
#include "core/arm_model.hpp"

namespace tankrig {

/// One view as the folder has it: a picture or a pose of the marker, and joints or a pose of the end effector.
struct HandEyeEntry {
  std::string name;  ///< "hand_eye.yaml:12", or the picture's file name
  std::filesystem::path image;
  std::optional<Transform> cMg;
  std::optional<JointVector> q;
  std::optional<Transform> bMe;
};

struct HandEyeData {
  std::filesystem::path file;
  std::vector<std::filesystem::path> files;  ///< this and what it names, without pictures
  std::optional<CameraModel> camera;         ///< required by pictures
  std::optional<GripperMarker> marker;       ///< likewise
  std::optional<ArmModel> arm;               ///< of the joints
  std::optional<Vector3d> target_c;
  double marker_size = 0.1;  ///< of the square that stands for a marker of which only poses are known [m]
  std::vector<HandEyeEntry> views;
};

/// `folder`: or its hand_eye.yaml.
/// Errors: InputError with file, line, key: unknown keys, views of mixed kinds, pictures without camera or marker.
HandEyeData read_hand_eye_folder(const std::filesystem::path& folder);

}  // namespace tankrig
