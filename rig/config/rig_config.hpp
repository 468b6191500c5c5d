// The rig file: which arm, cameras, laser and object stand where, and how a scan goes. etc/rigs/<name>/rig.yaml.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "core/calibrated_camera.hpp"
#include "core/config_node.hpp"
#include "rig/config/rig_calibration.hpp"
#include "rig/plan/motion_check.hpp"
#include "rig/plan/scan_settings.hpp"
#include "rig/plan/trigger_settings.hpp"

namespace tankrig {

struct RigCamera : CalibratedCamera {
  /// Its housing, in c [m]. The default is an assumed small underwater camera.
  Eigen::AlignedBox3d body{Vector3d(-0.04, -0.04, -0.12), Vector3d(0.04, 0.04, 0.03)};
  RecordWhen record = RecordWhen::kAll;
  double rate_hz = 25;
  TriggerSettings trigger;

  /// `body` in b.
  Box housing() const { return {bMc * Eigen::Translation3d(body.center()), body.sizes()}; }
};

/// Frames: e. Triangulation uses only the sheet; origin and direction limit its reach.
struct RigLaser {
  Plane ePl;
  Vector3d origin_e = Vector3d::Zero();      ///< the projector's exit, on the sheet [m]
  Vector3d direction_e = Vector3d::UnitZ();  ///< middle of the fan, unit, in the sheet
  double fan = 0.9;                          ///< full opening angle [rad]
};

struct RigObject {
  std::filesystem::path mesh;  ///< absolute
  Transform bMo = Transform::Identity();
};

/// The sections that other folders read themselves.
inline constexpr std::array kForeignSections{"reconstruction", "evaluation", "mock",      "truth",  "workspace",
                                             "devices",        "emulation",  "benchmark", "targets"};

/// A rig file, read and checked. `scan` is complete: it includes the laser and camera facts it needs.
struct RigConfig {
  explicit RigConfig(ConfigNode file_root) : file(file_root.file()), root(std::move(file_root)) {}

  std::filesystem::path file;
  std::string name, description;
  std::string backend;          ///< "mock": simulated in this process; "devices": drivers on wires, real or emulated
  std::filesystem::path scene;  ///< what is simulated or emulated, absolute; empty on a real rig
  std::string preset;           ///< applied to `scan`; empty if none
  std::filesystem::path calibration_file;     ///< absolute; empty: nominal values
  std::optional<RigCalibration> calibration;  ///< of that file, applied already
  std::string calibration_sha256;             ///< in a session's rig file: of the file that was applied
  ArmModel arm;
  MotionLimits motion_limits;
  std::array<double, kJoints> backlash_ticks{};  ///< total backlash between every encoder and its link; 0: not known
  ScanSettings scan;
  std::vector<RigCamera> cameras;
  RigLaser laser;
  RigObject object;
  Obstacles obstacles;  ///< without cameras and object

  /// One of kForeignSections; nothing if the file lacks it.
  std::optional<ConfigNode> section(std::string_view name) const;

  const RigCamera* find_camera(CameraRole role) const;

  ConfigNode root;  ///< the whole file, for section()
};

/// A rig file as YAML, completed from its `base: FILE`, and that one from its own.
/// Errors: InputError, also for a chain of more than three.
ConfigNode rig_file(const std::filesystem::path& file);

/// Reads a rig file, its calibration or `calibration` instead, and applies one of its presets to its scan ("" for none).
/// Foreign sections are not checked here: their readers call finish().
/// Errors: InputError "FILE:LINE: key: found ..., expected ...", also for an unknown key.
RigConfig load_rig(const std::filesystem::path& file, const std::string& preset = "",
                   const std::filesystem::path& calibration = {});
/// The same for a rig file that is already read.
RigConfig read_rig(const ConfigNode& file, const std::string& preset = "",
                   const std::filesystem::path& calibration = {});

/// By its file's own values alone, whatever calibration that names.
RigConfig load_drawn_rig(const std::filesystem::path& file);

/// The rig as used, presets and changes applied: a rig file again. `mesh` is its object's mesh, relative to where the
/// text will be stored.
std::string resolved_rig_yaml(const RigConfig& rig, const std::string& mesh);

/// Every key of the sections read here with its default, range and meaning, as rows of a Markdown table.
std::string rig_key_rows();

}  // namespace tankrig
