// Kalibr's camchain: a chain of pinhole cameras, each placed by T_cn_cnm1, which maps the previous camera's points to it.
#include <fmt/core.h>

#include "core/camera_file_reading.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr double kRotationTolerance = 1e-3;

Transform read_transform(const CameraFileReading& file, const CameraValue& value, const std::string& field) {
  const std::vector<double> m = file.flat_list(value, field, 16);
  Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool rigid = (R * R.transpose()).isIdentity(kRotationTolerance) && R.determinant() > 0 &&
                     T.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), kRotationTolerance);
  if (!rigid)
    file.fail(value, field, "found a matrix that is no rotation and translation, expected 4 x 4 numbers of one");
  Transform pose;
  pose.matrix() = T;
  return pose;
}

std::string expect_text(const CameraFileReading& file, const CameraValue& camera, const std::string& name,
                        const char* key, std::initializer_list<const char*> allowed) {
  const CameraValue& value = camera.child(key);
  std::string words;
  for (const char* one : allowed) {
    if (value.text == one) return one;
    words += (words.empty() ? "" : " or ") + std::string(one);
  }
  file.fail(
      value.present() ? value : camera, name + "." + key,
      value.present() ? "found '" + shown_text(value.text) + "', expected " + words : "missing, expected " + words);
}

FileCamera read_camera(const CameraFileReading& file, const CameraValue& value, const std::string& name) {
  if (value.kind != CameraValue::Kind::kMapping) file.fail(value, name, "found no mapping, expected a camera");
  FileCamera camera{name, {}, {}, {}};
  expect_text(file, value, name, "camera_model", {"pinhole"});
  const auto resolution = file.flat_list(value.child("resolution"), name + ".resolution", 2);
  camera.model.width = file.pixels(value.child("resolution").items.at(0), name + ".resolution");
  camera.model.height = file.pixels(value.child("resolution").items.at(1), name + ".resolution");
  const CameraValue& intrinsics = value.child("intrinsics");
  const auto k = file.flat_list(intrinsics, name + ".intrinsics", 4);
  file.set_pinhole(camera.model, {k[0], k[1], k[2], k[3]}, intrinsics, name + ".intrinsics");
  if (expect_text(file, value, name, "distortion_model", {"radtan", "none"}) == "radtan") {
    const CameraValue& d = value.child("distortion_coeffs");
    file.set_distortion(camera.model, file.flat_list(d, name + ".distortion_coeffs", 4), d,
                        name + ".distortion_coeffs");
  }
  file.check(camera.model);
  return camera;
}

std::string list(std::initializer_list<double> numbers) {
  std::string text;
  for (const double value : numbers) text += (text.empty() ? "[" : ", ") + plain_number(value);
  return text + "]";
}

}  // namespace

std::vector<FileCamera> read_kalibr_file(const CameraFileReading& file) {
  constexpr int kMostCameras = 100;
  std::vector<FileCamera> cameras;
  Transform cMr = Transform::Identity();
  for (int i = 0; i < kMostCameras; ++i) {
    const std::string name = fmt::format("cam{}", i);
    const CameraValue value = file.fields(name);
    if (!value.present()) break;
    cameras.push_back(read_camera(file, value, name));
    if (i > 0) {
      const CameraValue& T = value.child("T_cn_cnm1");
      if (!T.present()) file.fail(value, name + ".T_cn_cnm1", "missing, expected the previous camera's place");
      cMr = read_transform(file, T, name + ".T_cn_cnm1") * cMr;
    }
    cameras.back().cMr = cMr;
  }
  return cameras;
}

std::string kalibr_text(const std::vector<FileCamera>& cameras) {
  std::string text;
  Transform previous = Transform::Identity();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraModel& c = cameras[i].model;
    const Transform cMr = cameras[i].cMr.value_or(Transform::Identity());
    text += fmt::format("cam{}:\n  camera_model: pinhole\n  intrinsics: {}\n", i, list({c.fx, c.fy, c.cx, c.cy})) +
            fmt::format("  distortion_model: radtan\n  distortion_coeffs: {}\n", list({c.k1, c.k2, c.p1, c.p2}));
    if (i > 0) {
      const Eigen::Matrix4d T = (cMr * previous.inverse()).matrix();
      text += "  T_cn_cnm1:\n";
      for (int row = 0; row < 4; ++row) text += "  - " + list({T(row, 0), T(row, 1), T(row, 2), T(row, 3)}) + "\n";
    }
    text += fmt::format("  resolution: [{}, {}]\n", c.width, c.height);
    previous = cMr;
  }
  return text;
}

}  // namespace tankrig
