// Strict YAML: every key is asked for by name and range; anything else is an error with its line.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.hpp"

namespace YAML {
class Emitter;
}

namespace tankrig {

/// Of the keys of a mapping: core/settings_table.hpp.
template <class S>
struct SettingsTable;

/// Bounds of a number, both included.
struct ConfigRange {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();

  constexpr ConfigRange() = default;
  constexpr ConfigRange(double least, double most) : lower(least), upper(most) {}
};

/// A mapping of a YAML file. Each reader takes the keys it knows; finish() refuses what nobody took.
/// A number whose key ends in `_m` is a length in metres. A length that fits no tank is refused as a wrong unit.
/// Errors: every member throws InputError "FILE:LINE: key: found ..., expected ...".
class ConfigNode {
 public:
  using Range = ConfigRange;

  static ConfigNode load(const std::filesystem::path& file);
  /// `text` as if it stood in `file`, which need not exist.
  static ConfigNode parse(const std::string& text, const std::filesystem::path& file);

  /// This file, with keys it lacks taken from `base`, mapping by mapping. Each key keeps its file and line. Lists are
  /// not merged.
  ConfigNode over(const ConfigNode& base) const;

  bool has(std::string_view key) const;
  double number(std::string_view key, Range range = {}) const;
  double number_or(std::string_view key, double fallback, Range range = {}) const;
  int integer(std::string_view key, Range range = {}) const;
  int integer_or(std::string_view key, int fallback, Range range = {}) const;
  bool flag(std::string_view key) const;
  bool flag_or(std::string_view key, bool fallback) const;
  std::string text(std::string_view key) const;
  std::string text_or(std::string_view key, std::string_view fallback) const;
  /// One of `allowed`.
  std::string choice(std::string_view key, const std::vector<std::string>& allowed) const;
  std::string choice_or(std::string_view key, std::string_view fallback, const std::vector<std::string>& allowed) const;
  /// Exactly `count` numbers (any count if 0).
  std::vector<double> numbers(std::string_view key, std::size_t count = 0) const;
  std::vector<std::string> texts(std::string_view key) const;
  /// `translation_m` and `quaternion_xyzw` below `key`.
  Transform transform(std::string_view key) const;
  /// The mapping itself as a transform: `translation_m`, `quaternion_xyzw`.
  Transform as_transform() const;
  /// A path relative to this file's folder; absolute on return. Existence is not checked.
  std::filesystem::path path(std::string_view key) const;

  ConfigNode child(std::string_view key) const;
  std::optional<ConfigNode> optional_child(std::string_view key) const;
  /// Names of the keys of this mapping, in file order.
  std::vector<std::string> keys() const;
  /// The mappings of a sequence.
  std::vector<ConfigNode> items(std::string_view key) const;

  /// Throws on the first key, here or in a mapping taken from here, that was never asked for.
  void finish() const;

  /// "FILE:LINE: key: message", for checks across keys.
  [[noreturn]] void fail(std::string_view key, const std::string& message) const;

  const std::filesystem::path& file() const;

  /// This mapping as a value, block style, scalars as they were written.
  void write(YAML::Emitter& out) const;

 private:
  struct Node;
  template <class Load>
  static ConfigNode mapping_of(const std::filesystem::path& file, Load load);
  explicit ConfigNode(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

}  // namespace tankrig
