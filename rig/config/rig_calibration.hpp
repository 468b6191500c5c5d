// A rig file's calibration: its values take the place of the nominal ones.
#pragma once

#include <filesystem>
#include <string>

#include "core/calibration_file.hpp"

namespace tankrig {

struct RigConfig;

struct RigCalibration {
  std::filesystem::path file;
  std::string text;   ///< the whole file, for a copy
  std::string basis;  ///< calibration_basis() of the nominal rig
  Calibration values;
};

/// What must be the same for a calibration to be of this rig: its name, the arm, the cameras' names, roles and sizes. As
/// text, whose SHA-256 is Calibration::rig_sha256.
std::string calibration_basis(const RigConfig& nominal);

/// Reads `file` and puts its values into `rig`. Where the laser's exit lies off the calibrated sheet, it is moved onto it.
/// Errors: InputError of the file, also for a camera that the rig has not, or of another size.
RigCalibration apply_calibration(const std::filesystem::path& file, RigConfig& rig);

}  // namespace tankrig
