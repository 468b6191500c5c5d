// Strict XML: what nobody knows is an error, what UWSim knows and we do not simulate is a warning.
#include "core/xml_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1));
}

std::string shown(Bounds bounds) {
  if (std::isinf(bounds.lower) && std::isinf(bounds.upper)) return "a number";
  return fmt::format("a number in [{:g}, {:g}]", bounds.lower, bounds.upper);
}

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, changed});
    }
  }
  return row.back();
}

bool holds(const XmlElement::Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string joined(const auto& words) {
  std::string list;
  for (const auto& word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return list;
}

/// A DTD is named, not defined here: a definition could be a bomb, and nothing would read it.
bool only_names_a_dtd(const pugi::xml_node& node) {
  return node.type() == pugi::node_doctype && std::string_view(node.value()).find('[') == std::string_view::npos;
}

}  // namespace

struct XmlElement::Document {
  std::filesystem::path file;
  std::string text;
  pugi::xml_document xml;
  std::vector<std::string> warnings;

  int line(std::ptrdiff_t offset) const {
    const auto end = std::clamp<std::ptrdiff_t>(offset, 0, static_cast<std::ptrdiff_t>(text.size()));
    return 1 + static_cast<int>(std::count(text.begin(), text.begin() + end, '\n'));
  }
};

XmlElement XmlElement::load(const std::filesystem::path& file, std::string_view root_name, const XmlFileKind& kind) {
  auto document = std::make_shared<Document>();
  document->file = file;
  document->text = read_regular_file(file, kind.most_bytes, "a " + std::string(root_name));
  if (trimmed(document->text).empty()) throw InputError(file, "is empty, expected a " + std::string(root_name));
  if (const auto zero = document->text.find('\0'); zero != std::string::npos)
    throw InputError(file, document->line(static_cast<std::ptrdiff_t>(zero)), "found a byte 0, expected text");
  const auto parsed =
      document->xml.load_buffer(document->text.data(), document->text.size(),
                                pugi::parse_default | pugi::parse_doctype | pugi::parse_fragment, pugi::encoding_utf8);
  if (!parsed)
    throw InputError(
        file, document->line(parsed.offset),
        std::string("found XML that does not parse (") + parsed.description() + "), expected a " + kind.name);
  const pugi::xml_node first = document->xml.document_element();
  for (const pugi::xml_node node : document->xml.children()) {
    if (node == first || (kind.doctype && only_names_a_dtd(node))) continue;
    const auto begin = document->text.find_first_not_of(" \t\r\n", static_cast<std::size_t>(node.offset_debug()));
    const std::string found =
        node.type() == pugi::node_doctype   ? (kind.doctype ? "a DOCTYPE with definitions" : "a DOCTYPE")
        : node.type() == pugi::node_element ? "a second root element <" + shown_text(node.name()) + ">"
                                            : "text '" + shown_text(trimmed(node.value())) + "'";
    throw InputError(file, document->line(static_cast<std::ptrdiff_t>(begin)),
                     "found " + found + ", expected one <" + std::string(root_name) + "> and nothing beside it");
  }
  const XmlElement root(document, first);
  if (root.name() != root_name)
    root.fail("found root element <" + root.name() + ">, expected <" + std::string(root_name) + ">");
  return root;
}

int XmlElement::line() const { return document_->line(node_.offset_debug()); }
const std::filesystem::path& XmlElement::file() const { return document_->file; }
const std::vector<std::string>& XmlElement::warnings() const { return document_->warnings; }

void XmlElement::warn(const std::string& message) const {
  document_->warnings.push_back(fmt::format("{}:{}: {}", file().string(), line(), message));
}

void XmlElement::fail(const std::string& message) const { throw InputError(file(), line(), message); }

void XmlElement::refuse_attributes_but(const Names& known) const {
  for (const pugi::xml_attribute attribute : node_.attributes())
    if (!holds(known, attribute.name()))
      fail("<" + name() + ">: found attribute '" + shown_text(attribute.name()) + "', expected " +
           (known.empty() ? "none" : "none but " + joined(known)));
}

void XmlElement::expect(const Names& once, const Names& repeated, const Names& not_simulated,
                        const Names& attributes) const {
  refuse_attributes_but(attributes);
  for (const pugi::xml_node node : node_.children()) {
    const XmlElement element(document_, node);
    if (node.type() != pugi::node_element)
      element.fail("<" + name() + ">: found text '" + shown_text(trimmed(node.value())) + "', expected elements");
    if (holds(not_simulated, node.name())) {
      element.warn("<" + element.name() + "> is known to UWSim but not simulated");
      continue;
    }
    if (holds(once, node.name())) {
      if (node_.child(node.name()) != node)
        element.fail("found a second <" + element.name() + "> in <" + name() + ">, expected one");
      continue;
    }
    if (holds(repeated, node.name())) continue;
    std::string nearest;
    int best = std::numeric_limits<int>::max();
    for (const Names* names : {&once, &repeated, &not_simulated})
      for (const char* known : *names)
        if (const int distance = edit_distance(node.name(), known); distance < best) best = distance, nearest = known;
    element.fail("found unknown element <" + element.name() + "> in <" + name() + ">, expected one this element knows" +
                 (nearest.empty() ? "" : " (nearest: <" + nearest + ">)"));
  }
}

std::optional<XmlElement> XmlElement::optional(const char* child_name) const {
  const auto node = node_.child(child_name);
  if (!node) return std::nullopt;
  return XmlElement(document_, node);
}

XmlElement XmlElement::child(const char* child_name) const {
  if (auto element = optional(child_name)) return *element;
  fail("<" + name() + ">: found no <" + child_name + ">, expected one");
}

std::vector<XmlElement> XmlElement::children(const char* child_name) const {
  std::vector<XmlElement> found;
  for (const pugi::xml_node node : node_.children(child_name)) found.push_back(XmlElement(document_, node));
  return found;
}

std::vector<XmlElement> XmlElement::children() const {
  std::vector<XmlElement> found;
  for (const pugi::xml_node node : node_.children())
    if (node.type() == pugi::node_element) found.push_back(XmlElement(document_, node));
  return found;
}

std::optional<std::string> XmlElement::attribute(const char* attribute_name) const {
  const pugi::xml_attribute found = node_.attribute(attribute_name);
  if (!found) return std::nullopt;
  return found.value();
}

std::string XmlElement::attribute_choice(const char* attribute_name, const std::vector<std::string>& allowed) const {
  const std::optional<std::string> found = attribute(attribute_name);
  if (!found) return allowed.front();
  if (std::find(allowed.begin(), allowed.end(), *found) == allowed.end())
    fail("<" + name() + ">: " + attribute_name + ": found '" + shown_text(*found) +
         "', expected one of: " + joined(allowed));
  return *found;
}

std::string XmlElement::text(const Names& attributes) const {
  refuse_attributes_but(attributes);
  for (const pugi::xml_node node : node_.children())
    if (node.type() == pugi::node_element || node != node_.first_child())
      fail("<" + name() + ">: found more than one piece of text, expected a single value");
  const std::string value = trimmed(node_.text().get());
  if (value.empty()) fail("<" + name() + ">: found nothing, expected text");
  return value;
}

double XmlElement::number(Bounds bounds) const {
  const std::string value = text();
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size() || !std::isfinite(number) ||
      !(number >= bounds.lower && number <= bounds.upper))
    fail("<" + name() + ">: found '" + shown_text(value) + "', expected " + shown(bounds));
  return number;
}

double XmlElement::number(const char* child_name, Bounds bounds) const { return child(child_name).number(bounds); }

double XmlElement::number_or(const char* child_name, double fallback, Bounds bounds) const {
  const auto element = optional(child_name);
  return element ? element->number(bounds) : fallback;
}

int XmlElement::integer(const char* child_name, Bounds bounds) const {
  const XmlElement element = child(child_name);
  const double value = element.number(bounds);
  if (value != std::floor(value))
    element.fail("<" + element.name() + ">: found '" + element.text() + "', expected a whole number");
  return static_cast<int>(value);
}

bool XmlElement::flag_or(const char* child_name, bool fallback) const {
  const auto element = optional(child_name);
  if (!element) return fallback;
  const std::string value = element->text();
  if (value != "0" && value != "1") element->fail("<" + element->name() + ">: found '" + value + "', expected 0 or 1");
  return value == "1";
}

std::string XmlElement::text(const char* child_name) const { return child(child_name).text(); }

Vector3d XmlElement::triple(const char* child_name, const char* const (&parts)[3], Bounds bounds) const {
  const XmlElement element = child(child_name);
  element.expect({parts[0], parts[1], parts[2]});
  return {element.number(parts[0], bounds), element.number(parts[1], bounds), element.number(parts[2], bounds)};
}

Vector3d XmlElement::xyz(const char* child_name, Bounds bounds) const {
  return triple(child_name, {"x", "y", "z"}, bounds);
}

Vector3d XmlElement::xyz_or(const char* child_name, const Vector3d& fallback, Bounds bounds) const {
  return has(child_name) ? xyz(child_name, bounds) : fallback;
}

Eigen::Array3f XmlElement::rgb_or(const char* child_name, const Eigen::Array3f& fallback, Bounds bounds) const {
  if (!has(child_name)) return fallback;
  return triple(child_name, {"r", "g", "b"}, bounds).cast<float>().array();
}

Transform XmlElement::pose() const {
  const Vector3d position = xyz_or("position", Vector3d::Zero());
  const auto quaternion = optional("quaternion");
  if (!quaternion)
    return make_transform_rpy(position,
                              has("orientation") ? triple("orientation", {"r", "p", "y"}, {}) : Vector3d::Zero());
  if (has("orientation")) quaternion->fail("found <quaternion> beside <orientation>, expected one of them");
  quaternion->expect({"x", "y", "z", "w"});
  const Eigen::Vector4d xyzw(quaternion->number("x"), quaternion->number("y"), quaternion->number("z"),
                             quaternion->number("w"));
  if (std::abs(xyzw.norm() - 1) > 1e-3)
    quaternion->fail(fmt::format("<quaternion>: found norm {:g}, expected 1", xyzw.norm()));
  return make_transform(position, xyzw.normalized());
}

}  // namespace tankrig
