// One element of an XML file: strict reading, every error with its line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Bounds of a number, both included.
struct Bounds {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

inline constexpr Bounds kNotNegative{0, 1e9};
inline constexpr Bounds kFraction{0, 1};
inline constexpr Bounds kPositive{1e-9, 1e9};

/// What a kind of file may be.
struct XmlFileKind {
  std::string name;          ///< "scene"
  std::uint64_t most_bytes;  ///< of core/regular_file.hpp
  bool doctype = false;      ///< one that names a DTD may stand before the root; it is not read
};

/// Values are the text of child elements, as in UWSim: <position><x>0</x><y>0</y><z>1</z></position>.
/// Errors: every member throws InputError "FILE:LINE: element: found ..., expected ...".
class XmlElement {
 public:
  /// Root element of the file, which must be called `root_name`. Entities are never expanded and nothing is fetched.
  static XmlElement load(const std::filesystem::path& file, std::string_view root_name, const XmlFileKind& kind);

  std::string name() const { return node_.name(); }
  int line() const;
  const std::filesystem::path& file() const;

  using Names = std::vector<const char*>;

  /// Refuses every child that is in neither list, every other attribute, text between elements, and a child of `once`
  /// given twice. A child of `not_simulated` adds a warning with its line.
  void expect(const Names& once, const Names& repeated = {}, const Names& not_simulated = {},
              const Names& attributes = {}) const;

  bool has(const char* child) const { return !node_.child(child).empty(); }
  std::optional<XmlElement> optional(const char* child) const;
  XmlElement child(const char* name) const;
  std::vector<XmlElement> children(const char* name) const;
  std::vector<XmlElement> children() const;

  double number(const char* child, Bounds bounds = {}) const;
  double number_or(const char* child, double fallback, Bounds bounds = {}) const;
  int integer(const char* child, Bounds bounds) const;
  /// 0 or 1.
  bool flag_or(const char* child, bool fallback) const;
  std::string text(const char* child) const;
  /// This element's own number or text.
  double number(Bounds bounds = {}) const;
  std::string text(const Names& attributes = {}) const;

  std::optional<std::string> attribute(const char* name) const;
  /// One of `allowed`, the first of them if the attribute is absent.
  std::string attribute_choice(const char* name, const std::vector<std::string>& allowed) const;

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
  XmlElement(std::shared_ptr<Document> document, pugi::xml_node node) : document_(std::move(document)), node_(node) {}
  void refuse_attributes_but(const Names& known) const;
  Vector3d triple(const char* child, const char* const (&parts)[3], Bounds bounds) const;

  std::shared_ptr<Document> document_;
  pugi::xml_node node_;
};

}  // namespace tankrig
