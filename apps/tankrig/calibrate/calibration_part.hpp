// `calibrate ... --write FILE`: what was found becomes a part of a rig's calibration.yaml.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "calibration/estimate/estimate.hpp"
#include "calibration/hand_eye/hand_eye.hpp"
#include "calibration/object_pose/object_pose.hpp"
#include "calibration/stereo/stereo.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

struct WriteOptions {
  std::filesystem::path file;  ///< empty: nothing is written
  std::string rig;
  bool drawn = false;  ///< a new file starts from the rig file's own values, not from a calibration that it names
};
/// `--write`, and `--rig` unless the command has its own.
void add_write_options(CLI::App* command, WriteOptions& options);

/// A calibration.yaml open for a part more. Open it before long work: its errors come first.
class CalibrationPart {
 public:
  /// The file, or a new one.
  /// Errors: InputError, also if the file is of another rig, or of this one when arm or cameras were others.
  explicit CalibrationPart(const WriteOptions& options);

  /// With the values of the file, where there is one.
  const RigConfig& rig() const { return rig_; }
  /// Errors: InputError if the rig has no such camera, or if it has another size.
  const RigCamera& camera(const std::string& name) const;
  const RigCamera& camera(const std::string& name, int width, int height) const;
  /// Errors: InputError if the rig has no camera of this role.
  const RigCamera& camera(CameraRole role) const;

  Calibration values;

  /// Of what is computed now from `files` in the folder `data`.
  static CalibrationSource source(const std::string& method, const std::filesystem::path& data,
                                  std::vector<std::filesystem::path> files);
  /// Unchecked without `checks`: what was checked before was without this part. Else accepted if all passed.
  void write(std::vector<CalibrationCheck> checks = {});

 private:
  std::filesystem::path file_;
  RigConfig rig_;
};

/// What a solver found, as parts of a calibration. `camera` saw the marker, or the object; `given`: the arm
/// before its zeros were refined.
void put(CalibrationPart& part, const CalibrationSource& source, const StereoSolution& found);
void put(CalibrationPart& part, const CalibrationSource& source, const RigCamera& camera, const ArmModel& given,
         const HandEyeSolution& found);
void put(CalibrationPart& part, const CalibrationSource& source, const RigCamera& camera,
         const ObjectPoseSolution& found);

/// `estimates` are of fx, fy, cx, cy, k1, k2, p1, p2, k3 by name; what is not among them was held.
CalibratedLens calibrated_lens(const CameraModel& model, const std::vector<Estimate>& estimates, double rms_px,
                               std::size_t views, const CalibrationSource& source);

/// Standard deviations of a pose from the covariance of its step: a rotation about the axes of the frame it maps to, then a
/// translation along them.
CalibratedPose calibrated_pose(const Transform& aMb, const Eigen::Matrix<double, 6, 6>& covariance);
/// That of the inverse, from the covariance of a step of `aMb`.
CalibratedPose calibrated_inverse(const Transform& aMb, const Eigen::Matrix<double, 6, 6>& covariance);

}  // namespace tankrig::app
