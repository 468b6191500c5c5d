// One camera file while it is read: every complaint carries file, line and field.
#pragma once

#include <array>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/camera_fields.hpp"
#include "core/camera_file.hpp"
#include "core/camera_ranges.hpp"
#include "core/camera_xml.hpp"

namespace tankrig {

/// Errors: every member throws InputError.
struct CameraFileReading {
  std::filesystem::path path;
  CameraFields fields;

  [[noreturn]] void fail(const CameraValue& at, const std::string& field, const std::string& message) const;

  /// The first of `names` the file has; absent if none.
  std::pair<std::string, CameraValue> find(std::initializer_list<const char*> names) const;

  double number(const CameraValue& at, const std::string& field) const;
  /// The numbers of an OpenCV matrix, a ROS {rows, cols, data} mapping, or a plain (nested) list.
  std::vector<double> matrix(const CameraValue& value, const std::string& field) const;
  /// Of a plain list, with exactly `count` numbers; any count if 0.
  std::vector<double> flat_list(const CameraValue& list, const std::string& field, std::size_t count = 0) const;
  int pixels(const CameraValue& value, const std::string& field) const;

  /// Sets fx, fy, cx, cy, in this order.
  void set_pinhole(CameraModel& camera, const std::array<double, 4>& numbers, const CameraValue& at,
                   const std::string& field) const;
  /// Sets k1, k2, p1, p2, k3; what is beyond must be 0.
  void set_distortion(CameraModel& camera, const std::vector<double>& numbers, const CameraValue& at,
                      const std::string& field) const;
  /// Refuses a distortion that folds over.
  void check(const CameraModel& camera) const;
};

/// Numbers as YAML 1.1 readers (PyYAML) take them too: with a point where there is an exponent.
std::string plain_number(double value);

std::vector<FileCamera> read_kalibr_file(const CameraFileReading& file);
FileCamera read_mrcal_file(const CameraFileReading& file);
std::vector<FileCamera> read_visp_file(const CameraXml& xml, const std::filesystem::path& path);

std::string kalibr_text(const std::vector<FileCamera>& cameras);
std::string mrcal_text(const FileCamera& camera);
std::string visp_text(const FileCamera& camera);

}  // namespace tankrig
