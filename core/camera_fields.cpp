#include "core/camera_fields.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <memory>
#include <string_view>

#include "core/camera_xml.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

using Kind = CameraValue::Kind;

constexpr int kDeepest = 4;  // a matrix as a list of rows in a mapping; what is deeper is no camera's
constexpr std::string_view kSpace = " \t\r\n";

CameraValue value_of(const YAML::Node& node, int depth = 0) {
  if (!node.IsDefined()) return {};
  CameraValue value{Kind::kEmpty, std::max(node.Mark().line + 1, 1), {}, {}, {}};
  if (depth == kDeepest) return value;
  if (node.IsScalar()) {
    value.kind = Kind::kScalar;
    value.text = node.Scalar();
  } else if (node.IsSequence()) {
    value.kind = Kind::kList;
    for (const YAML::Node& item : node) value.items.push_back(value_of(item, depth + 1));
  } else if (node.IsMap()) {
    value.kind = Kind::kMapping;
    for (const auto& child : node) {
      if (!child.first.IsScalar()) continue;
      value.names.push_back(child.first.Scalar());
      value.items.push_back(value_of(child.second, depth + 1));
    }
  }
  return value;
}

/// mrcal's file is a Python dictionary, which YAML reads as a mapping but for the bytes it may hold: b'...' becomes ''.
void blank_python_bytes(std::string& text) {
  const std::size_t key = text.find("'optimization_inputs'");
  if (key == text.npos) return;
  const std::size_t begin = text.find("b'", key);
  const std::size_t end = begin == text.npos ? begin : text.find('\'', begin + 2);
  if (end != text.npos) text.replace(begin, end + 1 - begin, "''");
}

CameraFields yaml_fields(std::string text, const std::filesystem::path& file) {
  // OpenCV writes "%YAML:1.0", which is not a YAML directive: blank it, keep the line count.
  if (text.starts_with("%YAML")) text.replace(0, std::min(text.find('\n'), text.size()), "");
  blank_python_bytes(text);
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw InputError(file, std::max(e.mark.line + 1, 1),
                     shown_text(e.msg, 100) + ", expected a camera calibration in YAML");
  }
  if (!root.IsMap()) throw InputError(file, 1, "found no mapping, expected a camera calibration in YAML");
  return [root](const std::string& name) { return value_of(static_cast<const YAML::Node&>(root)[name]); };
}

/// A file in the notation of cv::FileStorage.
class OpenCvXml {
 public:
  OpenCvXml(std::string text, const std::filesystem::path& file) : xml_(std::move(text), file) {
    if (std::string_view(xml_.root().name()) != kRoot)
      throw InputError(
          file, xml_.line_of(xml_.root()),
          "found root element <" + shown_text(xml_.root().name()) + ">, expected <" + kRoot + ">, or ViSP's <root>");
  }

  CameraValue field(const std::string& name) const { return value_of(xml_.root().child(name.c_str())); }

 private:
  static constexpr const char* kRoot = "opencv_storage";

  CameraValue value_of(const pugi::xml_node& element, int depth = 0) const {
    if (!element) return {};
    CameraValue value{Kind::kEmpty, xml_.line_of(element), {}, {}, {}};
    if (depth == kDeepest) return value;
    std::vector<CameraValue> words;
    for (const pugi::xml_node child : element.children()) {
      if (child.type() != pugi::node_element) {
        add_words(child, words);
        continue;
      }
      value.names.emplace_back(child.name());
      value.items.push_back(value_of(child, depth + 1));
    }
    // Children all named "_" are the items of a list.
    if (std::ranges::any_of(value.names, [](const std::string& name) { return name != "_"; })) {
      value.kind = Kind::kMapping;
      return value;
    }
    if (value.items.empty()) value.items = std::move(words);
    const bool single = value.names.empty() && value.items.size() == 1 && std::string_view(element.name()) != "data";
    if (single) return value.items.front();
    value.names.clear();
    value.kind = Kind::kList;
    return value;
  }

  /// Numbers and words lie between spaces, a text with spaces between quotes.
  void add_words(const pugi::xml_node& node, std::vector<CameraValue>& words) const {
    const std::string_view all = node.value();
    int line = xml_.line_of(node);
    std::size_t counted = 0;
    for (std::size_t at = 0; (at = all.find_first_not_of(kSpace, at)) != all.npos;) {
      const bool quoted = all[at] == '"';
      const std::size_t begin = at + (quoted ? 1 : 0);
      const std::size_t end = std::min(quoted ? all.find('"', begin) : all.find_first_of(kSpace, begin), all.size());
      line += static_cast<int>(std::count(all.begin() + counted, all.begin() + at, '\n'));
      counted = at;
      words.push_back({Kind::kScalar, line, std::string(all.substr(begin, end - begin)), {}, {}});
      at = std::min(end + (quoted ? 1 : 0), all.size());
    }
  }

  CameraXml xml_;
};

}  // namespace

const CameraValue& CameraValue::child(const std::string& name) const {
  static const CameraValue kNone;
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? kNone : items[static_cast<std::size_t>(found - names.begin())];
}

CameraFields camera_fields(std::string text, const std::filesystem::path& file) {
  if (!CameraXml::is_xml(text)) return yaml_fields(std::move(text), file);
  const auto xml = std::make_shared<const OpenCvXml>(std::move(text), file);
  return [xml](const std::string& name) { return xml->field(name); };
}

}  // namespace tankrig
