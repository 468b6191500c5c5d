#include "core/camera_file.hpp"

#include <fmt/core.h>

#include <cmath>
#include <span>
#include <tuple>

#include "core/atomic_file.hpp"
#include "core/camera_file_reading.hpp"
#include "core/model_yaml.hpp"
#include "core/regular_file.hpp"
#include "core/settings_table.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

int size_of(const CameraFileReading& file, std::initializer_list<const char*> names, std::size_t index) {
  auto [name, value] = file.find(names);
  if (!value.present()) {
    std::tie(name, value) = file.find({"image_size", "imageSize", "Image_size"});
    if (value.kind != CameraValue::Kind::kList || value.items.size() != 2)
      throw InputError(file.path,
                       std::string(*names.begin()) + ": missing, expected the size of the calibrated image [px]");
    value = CameraValue(value.items[index]);
  }
  return file.pixels(value, name);
}

void read_matrix(const CameraFileReading& file, CameraModel& camera) {
  const auto [name, node] = file.find({"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K"});
  if (!node.present())
    throw InputError(file.path,
                     "camera_matrix: missing, expected nine numbers (also called Camera_Matrix, cameraMatrix, K)");
  const std::vector<double> k = file.matrix(node, name);
  if (k.size() != 9) file.fail(node, name, fmt::format("found {} numbers, expected 9", k.size()));
  if (k[1] != 0) file.fail(node, name, fmt::format("found skew {:f}, expected 0 (skew is not modelled)", k[1]));
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    file.fail(node, name, "expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
  file.set_pinhole(camera, {k[0], k[4], k[2], k[5]}, node, name);
}

void read_distortion(const CameraFileReading& file, CameraModel& camera) {
  const auto [model_name, model] = file.find({"distortion_model"});
  if (model.present() && model.text != "plumb_bob" && model.text != "rational_polynomial")
    file.fail(model, model_name,
              "found '" + shown_text(model.text) + "', expected plumb_bob, or rational_polynomial with k4, k5, k6 = 0");
  const auto [name, node] =
      file.find({"distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs", "D"});
  if (!node.present())
    throw InputError(
        file.path,
        "distortion_coefficients: missing, expected k1, k2, p1, p2[, k3] (also called Distortion_Coefficients, D)");
  const std::vector<double> d = file.matrix(node, name);
  if (d.size() != 0 && d.size() != 4 && d.size() != 5 && d.size() != 8 && d.size() != 12 && d.size() != 14)
    file.fail(node, name, fmt::format("found {} numbers, expected 4 or 5", d.size()));
  file.set_distortion(camera, d, node, name);
}

std::optional<Rectification> read_rectification(const CameraFileReading& file) {
  const auto [r_name, r] = file.find({"rectification_matrix"});
  const auto [p_name, p] = file.find({"projection_matrix"});
  if (!r.present() || !p.present()) return std::nullopt;
  const std::vector<double> R = file.matrix(r, r_name), P = file.matrix(p, p_name);
  if (R.size() != 9) file.fail(r, r_name, fmt::format("found {} numbers, expected 9", R.size()));
  if (P.size() != 12) file.fail(p, p_name, fmt::format("found {} numbers, expected 12", P.size()));
  return Rectification{cv::Matx33d(R.data()), cv::Matx34d(P.data())};
}

FileCamera read_opencv_or_ros(const CameraFileReading& file) {
  FileCamera camera{"camera", {}, {}, {}};
  camera.model.width = size_of(file, {"image_width", "image_Width", "width"}, 0);
  camera.model.height = size_of(file, {"image_height", "image_Height", "height"}, 1);
  read_matrix(file, camera.model);
  read_distortion(file, camera.model);
  file.check(camera.model);
  if (const auto [name, value] = file.find({"camera_name"}); !value.text.empty()) camera.name = value.text;
  camera.rectification = read_rectification(file);
  return camera;
}

std::array<double, 5> distortion_of(const CameraModel& c) { return {c.k1, c.k2, c.p1, c.p2, c.k3}; }

/// "[1, 0, 0]"
std::string list(std::span<const double> numbers) {
  std::string text;
  for (const double value : numbers) text += (text.empty() ? "[" : ", ") + exact_text(value);
  return text + "]";
}

/// `value` of a field as YAML; a name that is more than letters, digits and the like is quoted.
std::string yaml_name(const std::string& name) {
  const bool plain =
      !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) &&
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.") == name.npos;
  return plain ? name : yaml_quoted(name);
}

std::string ros_text(const FileCamera& camera) {
  const CameraModel& c = camera.model;
  const Rectification rectification = camera.rectification.value_or(rectification_of(c));
  const auto matrix = [](const char* key, int rows, std::size_t cols, std::span<const double> numbers) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", key, rows, cols, list(numbers));
  };
  const std::array<double, 5> d = distortion_of(c);
  return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", c.width, c.height,
                     yaml_name(camera.name)) +
         matrix("camera_matrix", 3, 3, c.matrix().val) + std::string("distortion_model: plumb_bob\n") +
         matrix("distortion_coefficients", 1, d.size(), d) + matrix("rectification_matrix", 3, 3, rectification.R.val) +
         matrix("projection_matrix", 3, 4, rectification.P.val);
}

std::string opencv_text(const FileCamera& camera) {
  const CameraModel& c = camera.model;
  const auto matrix = [](const char* key, int rows, std::size_t cols, std::span<const double> numbers) {
    return fmt::format("{}: !!opencv-matrix\n  rows: {}\n  cols: {}\n  dt: d\n  data: {}\n", key, rows, cols,
                       list(numbers));
  };
  const std::array<double, 5> d = distortion_of(c);
  return fmt::format("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\ncamera_name: {}\n", c.width, c.height,
                     yaml_quoted(camera.name)) +
         matrix("camera_matrix", 3, 3, c.matrix().val) + matrix("distortion_coefficients", 1, d.size(), d);
}

std::string opencv_xml_text(const FileCamera& camera) {
  const CameraModel& c = camera.model;
  const auto matrix = [](const char* key, int rows, std::size_t cols, std::span<const double> numbers) {
    std::string data;
    for (const double value : numbers) data += " " + exact_text(value);
    return fmt::format(
        "<{0} type_id=\"opencv-matrix\">\n  <rows>{1}</rows>\n  <cols>{2}</cols>\n  <dt>d</dt>\n  <data>{3}</data>\n"
        "</{0}>\n",
        key, rows, cols, data);
  };
  const std::array<double, 5> d = distortion_of(c);
  return fmt::format(
             "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>{}</image_width>\n<image_height>{}"
             "</image_height>\n",
             c.width, c.height) +
         matrix("camera_matrix", 3, 3, c.matrix().val) + matrix("distortion_coefficients", 1, d.size(), d) +
         "</opencv_storage>\n";
}

const Setting<FileCamera> kOwnRows[] = {
    {"name", &FileCamera::name, ""},
    {"model", &FileCamera::model, kCameraModelKeys, Need::kRequired, YAML::Flow},
};
constexpr SettingsTable<FileCamera> kOwn{kOwnRows};

std::string own_text(const FileCamera& camera) {
  YAML::Emitter out;
  write_mapping(out, kOwn, camera);
  return std::string(out.c_str()) + "\n";
}

std::string text_of(CameraFileFormat format, const std::vector<FileCamera>& cameras) {
  const FileCamera& camera = cameras.front();
  switch (format) {
    case CameraFileFormat::kOpenCv:
      return opencv_text(camera);
    case CameraFileFormat::kOpenCvXml:
      return opencv_xml_text(camera);
    case CameraFileFormat::kKalibr:
      return kalibr_text(cameras);
    case CameraFileFormat::kMrcal:
      return mrcal_text(camera);
    case CameraFileFormat::kVisp:
      return visp_text(camera);
    case CameraFileFormat::kTankrig:
      return own_text(camera);
    case CameraFileFormat::kRos:
      break;
  }
  return ros_text(camera);
}

std::string names_of(const std::vector<FileCamera>& cameras) {
  std::string names;
  for (const FileCamera& camera : cameras) names += (names.empty() ? "" : ", ") + shown_text(camera.name);
  return names;
}

}  // namespace

std::vector<FileCamera> read_camera_file_whole(const std::filesystem::path& path) {
  std::string text = read_regular_file(path, kMostYamlBytes, "a camera file (YAML, XML or .cameramodel)");
  if (CameraXml::is_xml(text)) {
    const CameraXml xml(text, path);
    if (std::string_view(xml.root().name()) == "root") return read_visp_file(xml, path);
  }
  const CameraFileReading file{path, camera_fields(text, path)};
  if (file.fields("cam0").present()) return read_kalibr_file(file);
  if (file.fields("lensmodel").present()) return {read_mrcal_file(file)};
  if (file.fields("model").present()) return {settings_from(ConfigNode::parse(text, path), kOwn)};
  return {read_opencv_or_ros(file)};
}

CameraModel read_camera_file(const std::filesystem::path& path) {
  const std::vector<FileCamera> cameras = read_camera_file_whole(path);
  if (cameras.size() > 1)
    throw InputError(path, fmt::format("found {} cameras ({}), expected one: `tankrig calibrate convert` takes one of "
                                       "them out",
                                       cameras.size(), names_of(cameras)));
  return cameras.front().model;
}

std::string lacking_in(CameraFileFormat format, const CameraModel& c) {
  if (c.port && format != CameraFileFormat::kTankrig) return "a flat port";
  const auto unless_zero = [](std::initializer_list<std::pair<const char*, double>> parameters) {
    std::string words;
    for (const auto& [name, value] : parameters)
      if (value != 0) words += fmt::format("{}{} = {}", words.empty() ? "" : ", ", name, exact_text(value));
    return words;
  };
  if (format == CameraFileFormat::kKalibr) return unless_zero({{"k3", c.k3}});
  if (format == CameraFileFormat::kVisp) return unless_zero({{"k2", c.k2}, {"p1", c.p1}, {"p2", c.p2}, {"k3", c.k3}});
  return "";
}

void write_camera_file(const std::filesystem::path& path, CameraFileFormat format,
                       const std::vector<FileCamera>& cameras) {
  if (cameras.size() > 1 && format != CameraFileFormat::kKalibr)
    throw InputError(path, fmt::format("found {} cameras ({}) for a file of format {}, which holds one: choose it with "
                                       "--camera",
                                       cameras.size(), names_of(cameras), name_of(format)));
  for (const FileCamera& camera : cameras)
    if (const std::string lacking = lacking_in(format, camera.model); !lacking.empty())
      throw InputError(
          path, fmt::format("{}: found {}, for which the format {} has no place, expected {}", shown_text(camera.name),
                            lacking, name_of(format),
                            camera.model.port                   ? "the format tankrig"
                            : format == CameraFileFormat::kVisp ? "a camera calibrated with --model k1"
                                                                : "a camera calibrated with --model k1k2 or k1k2p1p2"));
  write_file_durably(path, text_of(format, cameras));
}

Rectification rectification_of(const CameraModel& c) {
  return {cv::Matx33d::eye(), {c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0}};
}

void write_camera_file(const std::filesystem::path& path, const CameraModel& camera, const std::string& name) {
  write_camera_file(path, CameraFileFormat::kRos, {{name, camera, {}, {}}});
}

void write_camera_file(const std::filesystem::path& path, const CameraModel& camera, const std::string& name,
                       const Rectification& rectification) {
  write_camera_file(path, CameraFileFormat::kRos, {{name, camera, {}, rectification}});
}

void write_camera_files(const std::filesystem::path& folder, const CameraModel& camera, const std::string& name) {
  const std::filesystem::path file = folder / (name + ".yaml");
  if (camera.port) return write_camera_file(file, CameraFileFormat::kTankrig, {{name, camera, {}, {}}});
  write_camera_file(file, camera, name);
  write_opencv_camera_file(folder / (name + ".opencv.yml"), camera, name);
}

void write_opencv_camera_file(const std::filesystem::path& path, const CameraModel& camera, const std::string& name) {
  write_camera_file(path, CameraFileFormat::kOpenCv, {{name, camera, {}, {}}});
}

}  // namespace tankrig
