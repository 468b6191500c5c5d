#include "rig/config/rig_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "core/text_files.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig {
namespace {

RigCamera& camera_of(const CameraCalibration& calibrated, const std::filesystem::path& file, RigConfig& rig) {
  const auto found = std::find_if(rig.cameras.begin(), rig.cameras.end(),
                                  [&](const RigCamera& camera) { return camera.name == calibrated.name; });
  if (found == rig.cameras.end())
    throw InputError(file, "cameras: found '" + calibrated.name + "', expected a camera of " + rig.name);
  if (calibrated.lens &&
      (calibrated.lens->model.width != found->model.width || calibrated.lens->model.height != found->model.height))
    throw InputError(file, fmt::format("cameras: '{}' is {}x{} px, expected the {}x{} of {}", calibrated.name,
                                       calibrated.lens->model.width, calibrated.lens->model.height, found->model.width,
                                       found->model.height, rig.name));
  return *found;
}

void take_laser(const Plane& ePl, RigLaser& laser) {
  laser.ePl = ePl;
  laser.origin_e -= ePl.distance(laser.origin_e) * ePl.normal;
  laser.direction_e -= ePl.normal.dot(laser.direction_e) * ePl.normal;
  laser.direction_e.normalize();
}

}  // namespace

std::string calibration_basis(const RigConfig& nominal) {
  std::string text = "rig: " + nominal.name + "\narm:\n" + yaml_of(nominal.arm) + "\ncameras:\n";
  for (const RigCamera& camera : nominal.cameras)
    text += fmt::format("- {} {} {}x{}\n", camera.name, name_of(camera.role), camera.model.width, camera.model.height);
  return text;
}

RigCalibration apply_calibration(const std::filesystem::path& file, RigConfig& rig) {
  RigCalibration used{file, read_whole_file(file), calibration_basis(rig), {}};
  used.values = parse_calibration(used.text, file);
  const Calibration& c = used.values;
  for (const CameraCalibration& calibrated : c.cameras) {
    RigCamera& camera = camera_of(calibrated, file, rig);
    if (calibrated.lens) camera.model = calibrated.lens->model;
    if (calibrated.mount) camera.bMc = calibrated.mount->pose;
    if (calibrated.time) camera.time_offset = calibrated.time->offset;
  }
  if (c.joints)
    for (std::size_t i = 0; i < rig.arm.dh.size(); ++i) rig.arm.dh[i].theta0 = c.joints->theta0[i];
  if (c.laser) {
    if (c.laser->ePl.normal.cross(rig.laser.direction_e).norm() < 0.5)
      throw InputError(file, "laser.ePl: found a sheet across the laser's direction_e, expected one along it");
    take_laser(c.laser->ePl, rig.laser);
  }
  if (c.object) rig.object.bMo = c.object->pose;
  if (c.stereo) {
    const auto eye = [&](CameraRole role) {
      return std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const auto& k) { return k.role == role; });
    };
    const auto left = eye(CameraRole::kLeft), right = eye(CameraRole::kRight);
    if (left == rig.cameras.end() || right == rig.cameras.end())
      throw InputError(file, "stereo: found a pair, expected none: " + rig.name + " has no left and right camera");
    if (!c.camera(right->name) || !c.camera(right->name)->mount) right->bMc = left->bMc * c.stereo->pose;
  }
  return used;
}

}  // namespace tankrig
