#include "core/config_node.hpp"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "core/input_error.hpp"
#include "core/plausible_length.hpp"
#include "core/range_words.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"

namespace tankrig {

namespace {

/// Dotted keys that stand in another file than their mapping, and that file.
using Borrowed = std::map<std::string, std::filesystem::path, std::less<>>;

}  // namespace

struct ConfigNode::Node {
  std::filesystem::path file;
  YAML::Node yaml;
  std::string path;   ///< dotted keys down to this mapping
  std::string place;  ///< the same, for messages
  std::shared_ptr<const Borrowed> borrowed = std::make_shared<const Borrowed>();
  std::set<std::string, std::less<>> taken;
  std::vector<std::shared_ptr<Node>> children;

  std::string full(std::string_view key) const {
    return path.empty() ? std::string(key) : path + "." + std::string(key);
  }
  std::string full_place(std::string_view key) const { return (place.empty() ? "" : place + ".") + shown_text(key); }
  const std::filesystem::path& file_of(std::string_view key) const {
    const auto it = borrowed->find(full(key));
    return it == borrowed->end() ? file : it->second;
  }
  YAML::Node find(std::string_view key) {
    taken.emplace(key);
    // A const lookup: yaml-cpp's non-const operator[] would insert the key.
    return static_cast<const YAML::Node&>(yaml)[std::string(key)];
  }
};

namespace {

int line_of(const YAML::Node& node) { return node.Mark().line + 1; }

/// Where the value of `key` stands, for messages: its own line, or the mapping's.
int line_of_key(const YAML::Node& mapping, const std::string& key) {
  for (const auto& entry : mapping)
    if (entry.first.Scalar() == key) return entry.first.Mark().line + 1;
  return std::max(line_of(mapping), 1);
}

std::string shown(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  if (node.IsScalar()) return "'" + shown_text(node.Scalar()) + "'";
  return node.IsMap() ? "a mapping" : "a list of " + std::to_string(node.size());
}

std::optional<double> to_number(const YAML::Node& node) {
  if (!node.IsScalar()) return std::nullopt;
  const std::string& s = node.Scalar();
  double value = 0;
  const char* first = s.data() + (s.starts_with('+') ? 1 : 0);
  const auto [end, ec] = std::from_chars(first, s.data() + s.size(), value);
  if (ec != std::errc{} || end != s.data() + s.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// `own` with what it lacks taken from `base`, mapping by mapping; `prefix` is the dotted key down to here.
YAML::Node merged(const YAML::Node& own, const YAML::Node& base, const std::string& prefix,
                  const std::filesystem::path& base_file, Borrowed& borrowed) {
  YAML::Node out(YAML::NodeType::Map);
  const auto value_in = [](const YAML::Node& mapping, const std::string& key) { return mapping[key]; };
  for (const auto& entry : own) {
    const std::string key = entry.first.Scalar();
    const YAML::Node beneath = value_in(base, key);
    const bool both = entry.second.IsMap() && beneath.IsDefined() && beneath.IsMap();
    out[entry.first] =
        both ? merged(entry.second, beneath, prefix + key + ".", base_file, borrowed) : YAML::Node(entry.second);
  }
  for (const auto& entry : base) {
    const std::string key = entry.first.Scalar();
    if (value_in(own, key).IsDefined()) continue;
    out[entry.first] = entry.second;
    borrowed[prefix + key] = base_file;
  }
  return out;
}

/// By its name a length in metres, and by its value in millimetres.
bool in_wrong_unit(std::string_view key, double value) { return key.ends_with("_m") && !plausible_length(value); }

}  // namespace

template <class Load>
ConfigNode ConfigNode::mapping_of(const std::filesystem::path& file, Load load) {
  auto node = std::make_shared<Node>();
  node->file = file;
  try {
    node->yaml = load();
  } catch (const YAML::Exception& e) {
    throw InputError(file, std::max(e.mark.line + 1, 1), shown_text(e.msg, 100) + ", expected valid YAML");
  }
  if (!node->yaml.IsMap()) throw InputError(file, 1, "found " + shown(node->yaml) + ", expected a mapping");
  std::set<std::string> seen;
  for (const auto& entry : node->yaml)
    if (!seen.insert(entry.first.Scalar()).second)
      throw InputError(file, entry.first.Mark().line + 1,
                       shown_text(entry.first.Scalar()) + ": stands twice, expected once");
  return ConfigNode(std::move(node));
}

ConfigNode ConfigNode::load(const std::filesystem::path& file) {
  return parse(read_regular_file(file, kMostYamlBytes, "a YAML file"), file);
}

ConfigNode ConfigNode::parse(const std::string& text, const std::filesystem::path& file) {
  if (const std::size_t bad = find_unprintable(text); bad != std::string::npos)
    throw InputError(
        file, static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(bad), '\n')) + 1,
        fmt::format("found byte 0x{:02x}, expected printable UTF-8 text", static_cast<unsigned char>(text[bad])));
  return mapping_of(file, [&] { return YAML::Load(text); });
}

ConfigNode ConfigNode::over(const ConfigNode& base) const {
  auto borrowed = std::make_shared<Borrowed>();
  auto node = std::make_shared<Node>();
  node->file = node_->file;
  node->yaml = merged(node_->yaml, base.node_->yaml, "", base.node_->file, *borrowed);
  node->borrowed = std::move(borrowed);
  return ConfigNode(std::move(node));
}

const std::filesystem::path& ConfigNode::file() const { return node_->file; }

void ConfigNode::write(YAML::Emitter& out) const { out << node_->yaml; }

void ConfigNode::fail(std::string_view key, const std::string& message) const {
  throw InputError(node_->file_of(key), line_of_key(node_->yaml, std::string(key)),
                   node_->full_place(key) + ": " + message);
}

bool ConfigNode::has(std::string_view key) const { return node_->find(key).IsDefined(); }

double ConfigNode::number(std::string_view key, Range range) const {
  const YAML::Node value = node_->find(key);
  const auto number = value.IsDefined() ? to_number(value) : std::nullopt;
  if (number && in_wrong_unit(key, *number)) fail(key, "found " + shown(value) + kLooksLikeMillimetres);
  if (!number || *number < range.lower || *number > range.upper)
    fail(key, "found " + shown(value) + ", expected " + in_words(range));
  return *number;
}

double ConfigNode::number_or(std::string_view key, double fallback, Range range) const {
  return has(key) ? number(key, range) : fallback;
}

int ConfigNode::integer(std::string_view key, Range range) const {
  range.lower = std::max(range.lower, -2147483648.0);
  range.upper = std::min(range.upper, 2147483647.0);
  const double value = number(key, range);
  if (value != std::floor(value)) fail(key, "found " + shown(node_->find(key)) + ", expected a whole number");
  return static_cast<int>(value);
}

int ConfigNode::integer_or(std::string_view key, int fallback, Range range) const {
  return has(key) ? integer(key, range) : fallback;
}

bool ConfigNode::flag(std::string_view key) const {
  const YAML::Node value = node_->find(key);
  const std::string text = value.IsDefined() && value.IsScalar() ? value.Scalar() : "";
  if (text != "true" && text != "false") fail(key, "found " + shown(value) + ", expected true or false");
  return text == "true";
}

bool ConfigNode::flag_or(std::string_view key, bool fallback) const { return has(key) ? flag(key) : fallback; }

std::string ConfigNode::text(std::string_view key) const {
  const YAML::Node value = node_->find(key);
  if (!value.IsDefined() || !value.IsScalar()) fail(key, "found " + shown(value) + ", expected a text");
  return value.Scalar();
}

std::string ConfigNode::text_or(std::string_view key, std::string_view fallback) const {
  return has(key) ? text(key) : std::string(fallback);
}

std::string ConfigNode::choice(std::string_view key, const std::vector<std::string>& allowed) const {
  const std::string value = text(key);
  if (std::find(allowed.begin(), allowed.end(), value) != allowed.end()) return value;
  std::string list;
  for (const auto& a : allowed) list += (list.empty() ? "" : ", ") + a;
  fail(key, "found '" + shown_text(value) + "', expected one of: " + list);
}

std::string ConfigNode::choice_or(std::string_view key, std::string_view fallback,
                                  const std::vector<std::string>& allowed) const {
  return has(key) ? choice(key, allowed) : std::string(fallback);
}

std::vector<double> ConfigNode::numbers(std::string_view key, std::size_t count) const {
  const YAML::Node value = node_->find(key);
  const std::string expected =
      "expected a list of " + (count ? std::to_string(count) + " " : std::string()) + "numbers";
  if (!value.IsDefined() || !value.IsSequence() || (count && value.size() != count))
    fail(key, "found " + shown(value) + ", " + expected);
  std::vector<double> out;
  for (const auto& item : value) {
    const auto number = to_number(item);
    if (!number) fail(key, "found " + shown(item) + " in the list, " + expected);
    if (in_wrong_unit(key, *number)) fail(key, "found " + shown(item) + " in the list" + kLooksLikeMillimetres);
    out.push_back(*number);
  }
  return out;
}

std::vector<std::string> ConfigNode::texts(std::string_view key) const {
  const YAML::Node value = node_->find(key);
  if (!value.IsDefined() || !value.IsSequence()) fail(key, "found " + shown(value) + ", expected a list of texts");
  std::vector<std::string> out;
  for (const auto& item : value) {
    if (!item.IsScalar()) fail(key, "found " + shown(item) + " in the list, expected texts");
    out.push_back(item.Scalar());
  }
  return out;
}

Transform ConfigNode::transform(std::string_view key) const { return child(key).as_transform(); }

Transform ConfigNode::as_transform() const {
  const std::vector<double> t = numbers("translation_m", 3);
  const std::vector<double> q = numbers("quaternion_xyzw", 4);
  try {
    return make_transform({t[0], t[1], t[2]}, {q[0], q[1], q[2], q[3]});
  } catch (const InputError& e) {
    fail("quaternion_xyzw", e.what());
  }
}

std::filesystem::path ConfigNode::path(std::string_view key) const {
  const std::string value = text(key);
  if (value.empty()) fail(key, "found nothing, expected a file name");
  const auto whole = std::filesystem::absolute(node_->file_of(key).parent_path() / value).lexically_normal();
  if (find_unprintable(whole.string()) != std::string::npos)
    fail(key, "found '" + printable(whole.string()) + "', expected folders with names in UTF-8");
  return whole;
}

ConfigNode ConfigNode::child(std::string_view key) const {
  const YAML::Node value = node_->find(key);
  if (!value.IsDefined() || !value.IsMap()) fail(key, "found " + shown(value) + ", expected a mapping");
  std::set<std::string> seen;
  for (const auto& entry : value)
    if (!seen.insert(entry.first.Scalar()).second)
      throw InputError(
          node_->file_of(key), entry.first.Mark().line + 1,
          node_->full_place(key) + "." + shown_text(entry.first.Scalar()) + ": stands twice, expected once");
  for (const auto& known : node_->children)
    if (known->path == node_->full(key)) return ConfigNode(known);
  auto node = std::make_shared<Node>();
  node->file = node_->file_of(key);
  node->yaml = value;
  node->borrowed = node_->borrowed;
  node->path = node_->full(key);
  node->place = node_->full_place(key);
  node_->children.push_back(node);
  return ConfigNode(std::move(node));
}

std::optional<ConfigNode> ConfigNode::optional_child(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  return child(key);
}

std::vector<std::string> ConfigNode::keys() const {
  std::vector<std::string> out;
  for (const auto& entry : node_->yaml) out.push_back(entry.first.Scalar());
  return out;
}

std::vector<ConfigNode> ConfigNode::items(std::string_view key) const {
  const YAML::Node value = node_->find(key);
  if (!value.IsDefined() || !value.IsSequence()) fail(key, "found " + shown(value) + ", expected a list of mappings");
  std::vector<ConfigNode> out;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].IsMap()) fail(key, "found " + shown(value[i]) + " in the list, expected mappings");
    auto node = std::make_shared<Node>();
    node->file = node_->file_of(key);
    node->yaml = value[i];
    node->path = node_->full(key) + "[" + std::to_string(i) + "]";
    node->place = node_->full_place(key) + "[" + std::to_string(i) + "]";
    node_->children.push_back(node);
    out.push_back(ConfigNode(std::move(node)));
  }
  return out;
}

void ConfigNode::finish() const {
  for (const auto& entry : node_->yaml) {
    const std::string key = entry.first.Scalar();
    if (node_->taken.contains(key)) continue;
    std::string known;
    for (const std::string& name : node_->taken) known += (known.empty() ? "" : ", ") + name;
    throw InputError(node_->file_of(key), entry.first.Mark().line + 1,
                     node_->full_place(key) + ": unknown key, expected one of: " + known);
  }
  for (const auto& child : node_->children) ConfigNode(child).finish();
}

}  // namespace tankrig
