// calibration.yaml: what was measured of a rig, how well, from what, and whether to believe it.
//
// A part that was not calibrated is absent: the rig file's value stays. Values stand here whole, not as differences: to
// apply a file twice is to apply it once.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "core/camera_model.hpp"
#include "core/enum_names.hpp"
#include "core/time.hpp"

namespace tankrig {

/// Where a part comes from.
struct CalibrationSource {
  std::string method;       ///< of the solver, in a word
  std::string made_utc;     ///< ISO 8601
  std::string data;         ///< folder of the recordings, for people
  std::string data_sha256;  ///< of what was recorded, so that nobody takes one set for another; 64 digits
};

/// A rigid pose and one standard deviation of each of its freedoms, in the frame it maps to.
struct CalibratedPose {
  Transform pose = Transform::Identity();
  Vector3d sigma_m = Vector3d::Zero(), sigma_rad = Vector3d::Zero();
};

struct CalibratedLens : CalibrationSource {
  CameraModel model;
  std::vector<double> sigma;  ///< of fx, fy, cx, cy, k1, k2, p1, p2, k3; of a port found, three more
  double rms_px = 0;          ///< reprojection, per point
  int views = 0;
};

struct CalibratedMount : CalibrationSource, CalibratedPose {};  ///< bMc, eMg, bMo, or the right eye in the left one

struct CalibratedTime : CalibrationSource {
  Duration offset{}, sigma{};  ///< t_camera - t_joints
};

struct CameraCalibration {
  std::string name;
  std::optional<CalibratedLens> lens;
  std::optional<CalibratedMount> mount;  ///< bMc
  std::optional<CalibratedTime> time;
};

struct CalibratedJoints : CalibrationSource {
  std::array<double, 4> theta0{}, sigma{};  ///< DH's theta0 of slew, shoulder, elbow, jaw rotation [rad]
};

/// Two of a plane's freedoms are angles, about two axes in it; the third is its distance.
struct CalibratedLaser : CalibrationSource {
  Plane ePl;
  double sigma_rad = 0;  ///< of the normal's direction, the worse of both
  double sigma_m = 0;    ///< of the plane's distance from where it was measured
  double rms_m = 0;      ///< of the points it was fitted to
};

enum class CalibrationVerdict { kUnchecked, kAccepted, kRejected };
template <>
inline constexpr std::array kNames<CalibrationVerdict>{"unchecked", "accepted", "rejected"};

/// A figure that decides, from data that was held back.
struct CalibrationCheck {
  std::string name;
  double value = 0, limit = 0;  ///< accepted up to the limit, included
  std::string unit;

  bool passed() const { return value <= limit; }
};

bool all_passed(const std::vector<CalibrationCheck>& checks);

struct Calibration {
  std::string rig;         ///< its name
  std::string rig_sha256;  ///< of the nominal rig's parts that a calibration is about; 64 digits
  std::string made_utc;    ///< of the file
  std::string software;
  CalibrationVerdict verdict = CalibrationVerdict::kUnchecked;
  std::vector<CalibrationCheck> checks;
  std::vector<CameraCalibration> cameras;
  std::optional<CalibratedMount> stereo;  ///< the right eye in the left one
  std::optional<CalibratedJoints> joints;
  std::optional<CalibratedMount> gripper;  ///< eMg
  std::optional<CalibratedLaser> laser;
  std::optional<CalibratedMount> object;  ///< bMo

  const CameraCalibration* camera(const std::string& name) const;
  /// The entry of this name, made if there is none.
  CameraCalibration& camera(const std::string& name);
};

/// Errors: InputError with file, line and key: unknown keys, values out of range, a verdict that its checks contradict.
Calibration read_calibration(const std::filesystem::path& file);
Calibration parse_calibration(const std::string& text, const std::filesystem::path& file);

std::string calibration_text(const Calibration& calibration);

}  // namespace tankrig
