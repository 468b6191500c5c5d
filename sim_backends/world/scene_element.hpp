// One element of a scene file: strict reading, every error with its line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.hpp"

namespace tankrig::sim {

/// Bounds of a number, both included.
struct Bounds {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

inline constexpr Bounds kNotNegative{0, 1e9};
inline constexpr Bounds kFraction{0, 1};
inline constexpr Bounds kPositive{1e-9, 1e9};

/// Values are the text of child elements, as in UWSim: <position><x>0</x><y>0</y><z>1</z></position>.
/// Errors: every member throws InputError "FILE:LINE: element: found ..., expected ...".
class SceneElement {
 public:
  /// Root element of the file, which must be called `root_name`.
  static SceneElement load(const std::filesystem::path& file, std::string_view root_name);

  std::string name() const { return node_.name(); }
  int line() const;
  const std::filesystem::path& file() const;

  /// Refuses every child that is in neither list, every attribute, text between elements, and a child of `once` given
  /// twice. A child of `not_simulated` adds a warning with its line.
  void expect(std::initializer_list<const char*> once, std::initializer_list<const char*> repeated = {},
              std::initializer_list<const char*> not_simulated = {}) const;

  bool has(const char* child) const { return !node_.child(child).empty(); }
  std::optional<SceneElement> optional(const char* child) const;
  SceneElement child(const char* name) const;
  std::vector<SceneElement> children(const char* name) const;

  double number(const char* child, Bounds bounds = {}) const;
  double number_or(const char* child, double fallback, Bounds bounds = {}) const;
  int integer(const char* child, Bounds bounds) const;
  /// 0 or 1.
  bool flag_or(const char* child, bool fallback) const;
  std::string text(const char* child) const;
  /// This element's own number or text.
  double number(Bounds bounds = {}) const;
  std::string text() const;

  /// <x> <y> <z>
  Vector3d xyz(const char* child, Bounds bounds = {}) const;
  Vector3d xyz_or(const char* child, const Vector3d& fallback, Bounds bounds = {}) const;
  /// <r> <g> <b>
  Eigen::Array3f rgb_or(const char* child, const Eigen::Array3f& fallback, Bounds bounds) const;
  /// <position>, and <orientation> (r, p, y) or <quaternion> (x, y, z, w); missing values are zero.
  Transform pose() const;

  void warn(const std::string& message) const;
  [[noreturn]] void fail(const std::string& message) const;
  const std::vector<std::string>& warnings() const;

 private:
  struct Document;
  SceneElement(std::shared_ptr<Document> document, pugi::xml_node node) : document_(std::move(document)), node_(node) {}
  Vector3d triple(const char* child, const char* const (&parts)[3], Bounds bounds) const;

  std::shared_ptr<Document> document_;
  pugi::xml_node node_;
};

}  // namespace tankrig::sim
