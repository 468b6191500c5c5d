// The values of a camera file, whichever notation it is in: YAML, or OpenCV's XML.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tankrig {

struct CameraValue {
  enum class Kind { kAbsent, kEmpty, kScalar, kList, kMapping };

  Kind kind = Kind::kAbsent;
  int line = 1;
  std::string text;                ///< of a scalar
  std::vector<CameraValue> items;  ///< of a list or a mapping
  std::vector<std::string> names;  ///< of a mapping: one for each item

  bool present() const { return kind != Kind::kAbsent; }
  /// Of a mapping; absent if there is none of that name.
  const CameraValue& child(const std::string& name) const;
};

/// The value of that name at the top of the file; absent if there is none.
using CameraFields = std::function<CameraValue(const std::string& name)>;

/// XML if the first character is a `<`, else YAML, with or without OpenCV's first line.
/// Errors: InputError with file and line.
CameraFields camera_fields(std::string text, const std::filesystem::path& file);

}  // namespace tankrig
