// mrcal's .cameramodel: a Python dictionary with OpenCV's lens models and the pose of the reference in the camera.
#include <fmt/core.h>

#include <cmath>

#include "core/camera_file_reading.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

struct LensModel {
  const char* name;
  std::size_t coefficients;
};
constexpr LensModel kLensModels[] = {{"LENSMODEL_PINHOLE", 0},
                                     {"LENSMODEL_OPENCV4", 4},
                                     {"LENSMODEL_OPENCV5", 5},
                                     {"LENSMODEL_OPENCV8", 8},
                                     {"LENSMODEL_OPENCV12", 12}};

const LensModel& lens_model(const CameraFileReading& file) {
  const auto [name, value] = file.find({"lensmodel"});
  for (const LensModel& model : kLensModels)
    if (value.text == model.name) return model;
  file.fail(value, name,
            "found '" + shown_text(value.text) + "', expected LENSMODEL_PINHOLE or LENSMODEL_OPENCV4, 5, 8 or 12");
}

std::string list(const std::vector<double>& numbers) {
  std::string text;
  for (const double value : numbers) text += exact_text(value) + ", ";
  return "[ " + text + "]";
}

}  // namespace

FileCamera read_mrcal_file(const CameraFileReading& file) {
  FileCamera camera{file.path.stem().string(), {}, Transform::Identity(), {}};
  const LensModel& lens = lens_model(file);
  const auto [k_name, k] = file.find({"intrinsics"});
  const std::vector<double> numbers = file.flat_list(k, k_name, 4 + lens.coefficients);
  file.set_pinhole(camera.model, {numbers[0], numbers[1], numbers[2], numbers[3]}, k, k_name);
  file.set_distortion(camera.model, {numbers.begin() + 4, numbers.end()}, k, k_name);
  const auto [size_name, size] = file.find({"imagersize"});
  file.flat_list(size, size_name, 2);
  camera.model.width = file.pixels(size.items.at(0), size_name);
  camera.model.height = file.pixels(size.items.at(1), size_name);
  file.check(camera.model);
  const auto [pose_name, pose] = file.find({"extrinsics"});
  if (pose.present()) {
    const std::vector<double> rt = file.flat_list(pose, pose_name, 6);
    const Vector3d r(rt[0], rt[1], rt[2]);
    const double angle = r.norm();
    if (!(angle < 1e3))
      file.fail(pose, pose_name, fmt::format("found a rotation of {:.3g} rad, expected one turn", angle));
    camera.cMr->linear() =
        angle > 0 ? Eigen::AngleAxisd(angle, r / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    camera.cMr->translation() = Vector3d(rt[3], rt[4], rt[5]);
  }
  return camera;
}

std::string mrcal_text(const FileCamera& camera) {
  const CameraModel& c = camera.model;
  std::vector<double> numbers{c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2};
  if (c.k3 != 0) numbers.push_back(c.k3);
  const Transform cMr = camera.cMr.value_or(Transform::Identity());
  const Eigen::AngleAxisd turn(cMr.rotation());
  const Vector3d r = turn.angle() * turn.axis(), t = cMr.translation();
  return fmt::format(
      "{{\n    'lensmodel':  'LENSMODEL_OPENCV{}',\n    'intrinsics': {},\n    'extrinsics': {},\n    'imagersize': [ "
      "{}, "
      "{} ],\n}}\n",
      numbers.size() - 4, list(numbers), list({r.x(), r.y(), r.z(), t.x(), t.y(), t.z()}), c.width, c.height);
}

}  // namespace tankrig
