// An XML file with the lines its elements stand on.
#pragma once

#include <filesystem>
#include <pugixml.hpp>
#include <string>

namespace tankrig {

class CameraXml {
 public:
  /// Errors: InputError with file and line: not XML, or a byte 0.
  CameraXml(std::string text, const std::filesystem::path& file);

  pugi::xml_node root() const { return document_.document_element(); }
  int line_of(const pugi::xml_node& node) const { return line(static_cast<std::size_t>(node.offset_debug())); }

  /// Whether `text` is to be read as XML: its first character is a `<`.
  static bool is_xml(const std::string& text);

 private:
  int line(std::size_t offset) const;

  std::string text_;
  pugi::xml_document document_;
};

}  // namespace tankrig
