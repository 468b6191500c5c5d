// PLY: a header of elements with scalar and list properties, then their values.

#include <fmt/core.h>

#include <algorithm>

#include "core/input_error.hpp"
#include "reconstruction/cloud/scalar_fields.hpp"

namespace tankrig::cloud_file {
namespace {

struct Property {
  std::string name;
  Scalar type = Scalar::kF32;
  std::optional<Scalar> list_count;  ///< type of the length, for a list
  Target target = Target::kNone;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

enum class Format { kAscii, kLittle, kBig };

struct PlyHeader {
  Format format = Format::kAscii;
  std::vector<Element> elements;
  std::string frame;
  std::size_t data = 0;  ///< offset of the first value
  int lines = 0;
};

std::optional<Scalar> scalar_named(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames{{{"char", Scalar::kI8},
                                                                               {"int8", Scalar::kI8},
                                                                               {"uchar", Scalar::kU8},
                                                                               {"uint8", Scalar::kU8},
                                                                               {"short", Scalar::kI16},
                                                                               {"int16", Scalar::kI16},
                                                                               {"ushort", Scalar::kU16},
                                                                               {"uint16", Scalar::kU16},
                                                                               {"int", Scalar::kI32},
                                                                               {"int32", Scalar::kI32},
                                                                               {"uint", Scalar::kU32},
                                                                               {"uint32", Scalar::kU32},
                                                                               {"float", Scalar::kF32},
                                                                               {"float32", Scalar::kF32},
                                                                               {"double", Scalar::kF64},
                                                                               {"float64", Scalar::kF64}}};
  for (const auto& [known, type] : kNames)
    if (known == name) return type;
  return std::nullopt;
}

class PlyHeaderReader {
 public:
  PlyHeaderReader(const std::filesystem::path& file, std::string_view text) : file_(file), text_(text) {}

  PlyHeader read() {
    if (next() != "ply") fail("found '" + shown() + "', expected 'ply'");
    for (;;) {
      const std::string_view line = next();
      const auto parts = words(line);
      if (parts.empty() || parts[0] == "obj_info") continue;
      if (parts[0] == "end_header") break;
      if (parts[0] == "comment") {
        if (const auto frame = frame_comment(line.substr(line.find("comment") + 7))) header_.frame = *frame;
      } else if (parts[0] == "format") {
        read_format(parts);
      } else if (parts[0] == "element") {
        read_element(parts);
      } else if (parts[0] == "property") {
        read_property(parts);
      } else {
        fail("found '" + shown() + "', expected format, comment, element, property or end_header");
      }
    }
    if (!has_format_) fail("found no format line, expected one before end_header");
    header_.data = at_;
    header_.lines = line_number_;
    return std::move(header_);
  }

 private:
  std::string_view next() {
    const auto line = take_line(text_, at_);
    ++line_number_;
    if (!line) fail("header ends early, expected end_header");
    line_ = *line;
    return line_;
  }

  std::string shown() const { return std::string(line_.substr(0, 60)); }

  [[noreturn]] void fail(const std::string& message) const { throw InputError(file_, line_number_, message); }

  void read_format(const std::vector<std::string_view>& parts) {
    has_format_ = true;
    if (parts.size() == 3 && parts[1] == "ascii")
      header_.format = Format::kAscii;
    else if (parts.size() == 3 && parts[1] == "binary_little_endian")
      header_.format = Format::kLittle;
    else if (parts.size() == 3 && parts[1] == "binary_big_endian")
      header_.format = Format::kBig;
    else
      fail("found '" + shown() + "', expected format ascii, binary_little_endian or binary_big_endian, and 1.0");
  }

  void read_element(const std::vector<std::string_view>& parts) {
    const auto count = parts.size() == 3 ? count_of(parts[2]) : std::nullopt;
    if (!count) fail("found '" + shown() + "', expected element NAME COUNT");
    header_.elements.push_back({std::string(parts[1]), *count, {}});
  }

  void read_property(const std::vector<std::string_view>& parts) {
    if (header_.elements.empty()) fail("found a property, expected an element before it");
    Property property;
    const bool list = parts.size() == 5 && parts[1] == "list";
    if (!list && parts.size() != 3)
      fail("found '" + shown() + "', expected property TYPE NAME or property list TYPE TYPE NAME");
    if (list) property.list_count = checked_type(parts[2]);
    property.type = checked_type(parts[list ? 3 : 1]);
    property.name = parts[list ? 4 : 2];
    if (!list && header_.elements.back().name == "vertex") property.target = target_of(property.name);
    header_.elements.back().properties.push_back(std::move(property));
  }

  Scalar checked_type(std::string_view name) const {
    const auto type = scalar_named(name);
    if (!type) fail("found type '" + std::string(name) + "', expected a PLY number type such as float");
    return *type;
  }

  const std::filesystem::path& file_;
  std::string_view text_;
  std::string_view line_;
  std::size_t at_ = 0;
  int line_number_ = 0;
  bool has_format_ = false;
  PlyHeader header_;
};

/// The values after the header, one after the other; nothing where the data ends.
class ValueReader {
 public:
  ValueReader(const std::filesystem::path& file, const PlyHeader& header, std::string_view text)
      : format_(header.format), data_(text.substr(header.data)), tokens_(file, data_, header.lines + 1) {}

  std::optional<double> value(Scalar type, std::string_view name) {
    if (format_ == Format::kAscii) return tokens_.number(name);
    if (data_.size() - at_ < size_of(type)) return std::nullopt;
    const double result = decode(data_.data() + at_, type, format_ == Format::kBig);
    at_ += size_of(type);
    return result;
  }

 private:
  Format format_;
  std::string_view data_;
  TokenReader tokens_;
  std::size_t at_ = 0;
};

/// False where the data ends.
bool skip_list(ValueReader& values, const Property& property) {
  const auto count = values.value(*property.list_count, property.name);
  if (!count) return false;
  for (double i = 0; i < *count; ++i)
    if (!values.value(property.type, property.name)) return false;
  return true;
}

bool read_instance(ValueReader& values, const Element& element, PointCollector& points) {
  for (const Property& property : element.properties) {
    if (property.list_count) {
      if (!skip_list(values, property)) return false;
      continue;
    }
    const auto value = values.value(property.type, property.name);
    if (!value) return false;
    points.set(property.target, property.type, *value);
  }
  return true;
}

}  // namespace

PointCloud read_ply(const std::filesystem::path& file, std::string_view text) {
  const PlyHeader header = PlyHeaderReader(file, text).read();
  const auto vertex =
      std::find_if(header.elements.begin(), header.elements.end(), [](const Element& e) { return e.name == "vertex"; });
  if (vertex == header.elements.end()) throw InputError(file, "found no element 'vertex', expected one");
  for (const Target needed : {Target::kX, Target::kY, Target::kZ})
    if (std::none_of(vertex->properties.begin(), vertex->properties.end(),
                     [&](const Property& p) { return p.target == needed; }))
      throw InputError(file, fmt::format("vertex: found no property '{}', expected x, y and z", axis_name(needed)));
  PointCloud cloud;
  cloud.frame = header.frame;
  cloud.points.reserve(std::min(vertex->count, text.size()));
  ValueReader values(file, header, text);
  for (auto element = header.elements.begin(); element <= vertex; ++element) {
    if (element->properties.empty()) continue;
    PointCollector points(cloud);
    for (std::size_t i = 0; i < element->count; ++i) {
      points.begin();
      if (!read_instance(values, *element, points)) {
        if (element == vertex) fail_truncated(file, i, vertex->count);
        throw InputError(file, fmt::format("data ends early: found {} of element {}, expected {}", i, element->name,
                                           element->count));
      }
      if (element == vertex) points.end();
    }
  }
  return cloud;
}

std::string ply_text(const PointCloud& cloud, bool ascii) {
  const bool normals = cloud.has_normals();
  std::string out = fmt::format(
      "ply\n"
      "format {} 1.0\n"
      "comment tankrig cloud: x y z and sigma in metres, intensity 0..1, column in pixels\n"
      "comment frame {}\n"
      "element vertex {}\n"
      "property float x\n"
      "property float y\n"
      "property float z\n"
      "property float intensity\n"
      "property int frame\n"
      "property float column\n"
      "property float sigma\n"
      "{}"
      "end_header\n",
      ascii ? "ascii" : "binary_little_endian", cloud.frame, cloud.points.size(),
      normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "");
  for (const CloudPoint& point : cloud.points) append_point(out, point, ascii, normals);
  return out;
}

}  // namespace tankrig::cloud_file
