#include "core/camera_file.hpp"

#include <fmt/core.h>

#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <span>
#include <tuple>

#include "core/atomic_file.hpp"
#include "core/camera_fields.hpp"
#include "core/camera_ranges.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

/// One camera file while it is read: every complaint carries file, line and field.
struct CameraFile {
  std::filesystem::path path;
  CameraFields fields;

  [[noreturn]] void fail(const CameraValue& at, const std::string& field, const std::string& message) const {
    throw InputError(path, at.line, field + ": " + message);
  }

  void expect(const CameraValue& at, const std::string& field, const char* parameter, double value,
              ConfigRange range) const {
    if (!(value >= range.lower && value <= range.upper))
      fail(at, field,
           fmt::format("found {} = {}, expected a number from {} to {}", parameter, exact_text(value),
                       exact_text(range.lower), exact_text(range.upper)));
  }

  /// The first of `names` the file has; absent if none.
  std::pair<std::string, CameraValue> find(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (CameraValue value = fields(name); value.present()) return {name, std::move(value)};
    return {*names.begin(), {}};
  }

  double number(const CameraValue& at, const std::string& field) const {
    const std::string& text = at.text;
    const char* first = text.data() + (text.starts_with('+') ? 1 : 0);
    double value = 0;
    const auto [end, ec] = std::from_chars(first, text.data() + text.size(), value);
    const bool all = end == text.data() + text.size() || std::string_view(end) == ".";
    if (ec != std::errc{} || !all || !std::isfinite(value))
      fail(at, field, "found '" + shown_text(text) + "', expected a number");
    return value;
  }

  /// The numbers of an OpenCV matrix, a ROS {rows, cols, data} mapping, or a plain (nested) list.
  std::vector<double> matrix(const CameraValue& value, const std::string& field) const {
    if (value.kind != CameraValue::Kind::kMapping) return flat_list(value, field);
    const CameraValue &data = value.child("data"), &rows = value.child("rows"), &cols = value.child("cols");
    if (!data.present()) fail(value, field, "found no 'data', expected rows, cols and data");
    std::vector<double> values = flat_list(data, field + ".data");
    if (rows.present() && cols.present()) {
      const double expected = number(rows, field + ".rows") * number(cols, field + ".cols");
      if (expected != static_cast<double>(values.size()))
        fail(data, field + ".data",
             fmt::format("found {} numbers, expected rows x cols = {}", values.size(), expected));
    }
    return values;
  }

  std::vector<double> flat_list(const CameraValue& list, const std::string& field) const {
    if (list.kind != CameraValue::Kind::kList) fail(list, field, "found no list, expected numbers");
    std::vector<double> values;
    for (const CameraValue& item : list.items) {
      if (item.kind == CameraValue::Kind::kList)
        for (const CameraValue& inner : item.items) values.push_back(number(inner, field));
      else
        values.push_back(number(item, field));
    }
    return values;
  }

  int size(std::initializer_list<const char*> names, std::size_t index) const {
    auto [name, value] = find(names);
    if (!value.present()) {
      std::tie(name, value) = find({"image_size", "imageSize", "Image_size"});
      if (value.kind != CameraValue::Kind::kList || value.items.size() != 2)
        throw InputError(path,
                         std::string(*names.begin()) + ": missing, expected the size of the calibrated image [px]");
      value = CameraValue(value.items[index]);
    }
    const double pixels = number(value, name);
    if (pixels < 1 || pixels > 100000 || pixels != std::floor(pixels))
      fail(value, name, "found " + shown_text(value.text) + ", expected a whole number of pixels from 1 to 100000");
    return static_cast<int>(pixels);
  }
};

void read_matrix(const CameraFile& file, CameraModel& camera) {
  const auto [name, node] = file.find({"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K"});
  if (!node.present())
    throw InputError(file.path,
                     "camera_matrix: missing, expected nine numbers (also called Camera_Matrix, cameraMatrix, K)");
  const std::vector<double> k = file.matrix(node, name);
  if (k.size() != 9) file.fail(node, name, fmt::format("found {} numbers, expected 9", k.size()));
  if (k[1] != 0) file.fail(node, name, fmt::format("found skew {:f}, expected 0 (skew is not modelled)", k[1]));
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    file.fail(node, name, "expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
  file.expect(node, name, "fx", k[0], kFocalRange);
  file.expect(node, name, "fy", k[4], kFocalRange);
  file.expect(node, name, "cx", k[2], kPrincipalPointRange);
  file.expect(node, name, "cy", k[5], kPrincipalPointRange);
  camera.fx = k[0], camera.cx = k[2], camera.fy = k[4], camera.cy = k[5];
}

void read_distortion(const CameraFile& file, CameraModel& camera) {
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
  std::vector<double> d = file.matrix(node, name);
  if (d.size() != 0 && d.size() != 4 && d.size() != 5 && d.size() != 8 && d.size() != 12 && d.size() != 14)
    file.fail(node, name, fmt::format("found {} numbers, expected 4 or 5", d.size()));
  for (std::size_t i = 5; i < d.size(); ++i)
    if (d[i] != 0)
      file.fail(node, name, "found a coefficient beyond k3 that is not 0, expected k1, k2, p1, p2, k3 only");
  d.resize(5, 0.0);
  file.expect(node, name, "k1", d[0], kRadialRange);
  file.expect(node, name, "k2", d[1], kRadialRange);
  file.expect(node, name, "p1", d[2], kTangentialRange);
  file.expect(node, name, "p2", d[3], kTangentialRange);
  file.expect(node, name, "k3", d[4], kRadialRange);
  camera.k1 = d[0], camera.k2 = d[1], camera.p1 = d[2], camera.p2 = d[3], camera.k3 = d[4];
}

/// "[1, 0, 0]"
std::string list(std::span<const double> numbers) {
  std::string text;
  for (const double value : numbers) text += (text.empty() ? "[" : ", ") + exact_text(value);
  return text + "]";
}

std::array<double, 5> distortion_of(const CameraModel& c) { return {c.k1, c.k2, c.p1, c.p2, c.k3}; }

}  // namespace

CameraModel read_camera_file(const std::filesystem::path& path) {
  const CameraFile file{path,
                        camera_fields(read_regular_file(path, kMostYamlBytes, "a camera file (YAML or XML)"), path)};
  CameraModel camera;
  camera.width = file.size({"image_width", "image_Width", "width"}, 0);
  camera.height = file.size({"image_height", "image_Height", "height"}, 1);
  read_matrix(file, camera);
  read_distortion(file, camera);
  if (!camera.invertible()) throw InputError(path, kFoldsOver);
  return camera;
}

Rectification rectification_of(const CameraModel& c) {
  return {cv::Matx33d::eye(), {c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0}};
}

void write_camera_file(const std::filesystem::path& path, const CameraModel& camera, const std::string& name) {
  write_camera_file(path, camera, name, rectification_of(camera));
}

void write_camera_file(const std::filesystem::path& path, const CameraModel& c, const std::string& name,
                       const Rectification& rectification) {
  const auto matrix = [](const char* key, int rows, int cols, std::span<const double> numbers) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", key, rows, cols, list(numbers));
  };
  write_file_durably(path,
                     fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", c.width, c.height, name) +
                         matrix("camera_matrix", 3, 3, c.matrix().val) + "distortion_model: plumb_bob\n" +
                         matrix("distortion_coefficients", 1, 5, distortion_of(c)) +
                         matrix("rectification_matrix", 3, 3, rectification.R.val) +
                         matrix("projection_matrix", 3, 4, rectification.P.val));
}

void write_opencv_camera_file(const std::filesystem::path& path, const CameraModel& c, const std::string& name) {
  const auto matrix = [](const char* key, int rows, int cols, std::span<const double> numbers) {
    return fmt::format("{}: !!opencv-matrix\n  rows: {}\n  cols: {}\n  dt: d\n  data: {}\n", key, rows, cols,
                       list(numbers));
  };
  write_file_durably(
      path,
      fmt::format("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\ncamera_name: \"{}\"\n", c.width, c.height, name) +
          matrix("camera_matrix", 3, 3, c.matrix().val) + matrix("distortion_coefficients", 1, 5, distortion_of(c)));
}

}  // namespace tankrig
