// Settings said once: a table names each key, the member it fills, its range and its meaning. Reading, writing and
// documenting follow from it.
#pragma once

#include <yaml-cpp/emitter.h>
#include <yaml-cpp/emittermanip.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/angles.hpp"
#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "core/model_yaml.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "core/time.hpp"

namespace tankrig {

/// Values are SI in memory. A key in _ms, _mm or _deg, or _us for a duration, is converted. A number whose member's
/// name has a unit keeps it.
constexpr double to_si(std::string_view key, double number) {
  if (key.ends_with("_deg")) return from_degrees(number);
  return key.ends_with("_ms") || key.ends_with("_mm") ? 1e-3 * number : number;
}
constexpr double from_si(std::string_view key, double si) {
  if (key.ends_with("_deg")) return to_degrees(si);
  return key.ends_with("_ms") || key.ends_with("_mm") ? 1e3 * si : si;
}

/// Divided once, so that a minute is 60, not 60.00000000000001.
constexpr double in_unit_of(std::string_view key, Duration value) {
  return static_cast<double>(value.count()) / (key.ends_with("_us") ? 1e3 : key.ends_with("_ms") ? 1e6 : 1e9);
}

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

/// How many numbers a value has; 0: any.
template <class T>
inline constexpr int kNumbers = -1;
template <>
inline constexpr int kNumbers<std::vector<double>> = 0;
template <>
inline constexpr int kNumbers<Vector3d> = 3;
template <>
inline constexpr int kNumbers<JointVector> = kJoints;
template <class N, std::size_t count>
inline constexpr int kNumbers<std::array<N, count>> = count;

/// "five whole numbers", "0.1 to 10".
template <class T>
std::string numbers_in_words() {
  constexpr const char* kWords[] = {"", "one ", "two ", "three ", "four ", "five "};
  return std::string(kWords[kNumbers<T>]) +
         (std::is_integral_v<std::remove_cvref_t<decltype(T{}[0])>> ? "whole numbers" : "numbers");
}
inline std::string shown_range(const ConfigRange& range) {
  const bool low = std::isfinite(range.lower), high = std::isfinite(range.upper);
  return low && high ? exact_text(range.lower) + " to " + exact_text(range.upper)
         : low       ? "at least " + exact_text(range.lower)
         : high      ? "at most " + exact_text(range.upper)
                     : "";
}

/// Errors: InputError with file, line and key.
template <class T>
T read_value(const ConfigNode& node, const char* key, const ConfigRange& range) {
  if constexpr (kIsOptional<T>) {
    return read_value<typename T::value_type>(node, key, range);
  } else if constexpr (std::is_same_v<T, bool>) {
    return node.flag(key);
  } else if constexpr (std::is_enum_v<T>) {
    const auto& names = kNames<T>;
    return static_cast<T>(std::find(names.begin(), names.end(), node.choice(key, {names.begin(), names.end()})) -
                          names.begin());
  } else if constexpr (std::is_integral_v<T>) {
    if (sizeof(T) < 8 || std::isfinite(range.upper)) return static_cast<T>(node.integer(key, range));
    const std::string text = node.text(key);
    T value{};
    if (!parse_number(text, value))
      node.fail(key, "found '" + shown_text(text) + "', expected a whole number" +
                         (std::is_unsigned_v<T> ? " of at least 0" : ""));
    return value;
  } else if constexpr (std::is_same_v<T, Stamp>) {
    return {read_value<std::int64_t>(node, key, range)};
  } else if constexpr (std::is_same_v<T, double>) {
    return to_si(key, node.number(key, range));
  } else if constexpr (std::is_same_v<T, Duration>) {
    const double number = node.number(key, range);
    return from_seconds(std::string_view(key).ends_with("_us") ? 1e-6 * number : to_si(key, number));
  } else if constexpr (std::is_same_v<T, std::string>) {
    return node.text(key);
  } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return node.path(key);
  } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    return node.texts(key);
  } else if constexpr (std::is_same_v<T, Transform>) {
    return node.transform(key);
  } else if constexpr (std::is_same_v<T, Plane>) {
    return read_plane(node.child(key));
  } else {
    using Number = std::remove_cvref_t<decltype(T{}[0])>;
    const std::vector<double> values = node.numbers(key, kNumbers<T>);
    T out{};
    if constexpr (requires { out.setZero(); }) out.setZero();
    if constexpr (kNumbers<T> == 0) out.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = values[i];
      if (!(value >= range.lower && value <= range.upper) || (std::is_integral_v<Number> && value != std::floor(value)))
        node.fail(key, "found " + yaml_of(values) + ", expected " + numbers_in_words<T>() +
                           (shown_range(range).empty() ? "" : " from " + shown_range(range)));
      out[static_cast<decltype(out.size())>(i)] = static_cast<Number>(value);
    }
    return out;
  }
}

template <class T>
void write_value(YAML::Emitter& out, const char* key, const T& value) {
  if constexpr (kIsOptional<T>) {
    write_value(out, key, *value);
  } else if constexpr (std::is_same_v<T, bool>) {
    out << value;
  } else if constexpr (std::is_enum_v<T>) {
    out << name_of(value);
  } else if constexpr (std::is_integral_v<T>) {
    out << std::to_string(value);
  } else if constexpr (std::is_same_v<T, Stamp>) {
    out << std::to_string(value.ns);
  } else if constexpr (std::is_same_v<T, double>) {
    out << exact_text(from_si(key, value));
  } else if constexpr (std::is_same_v<T, Duration>) {
    out << exact_text(in_unit_of(key, value));
  } else if constexpr (std::is_same_v<T, std::string>) {
    out << YAML::DoubleQuoted << value;
  } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
    out << YAML::DoubleQuoted << value.string();
  } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    out << YAML::Flow << YAML::BeginSeq;
    for (const std::string& text : value) out << YAML::DoubleQuoted << text;
    out << YAML::EndSeq;
  } else if constexpr (std::is_same_v<T, Transform> || std::is_same_v<T, Plane>) {
    emit(out, value);
  } else {
    emit_list(out, value);
  }
}

/// What may stand there, in words.
template <class T>
std::string expected_of(const ConfigRange& range) {
  const auto with_range = [&](const std::string& what) {
    const std::string words = shown_range(range);
    return what.empty() ? words.empty() ? "a number" : words : words.empty() ? what : what + ", each " + words;
  };
  if constexpr (kIsOptional<T>) {
    return expected_of<typename T::value_type>(range);
  } else if constexpr (std::is_same_v<T, bool>) {
    return "true or false";
  } else if constexpr (std::is_enum_v<T>) {
    std::string words;
    for (const char* name : kNames<T>) words += (words.empty() ? "" : ", ") + std::string(name);
    return words;
  } else if constexpr (std::is_integral_v<T> || std::is_same_v<T, Stamp>) {
    return with_range("") + ", whole";
  } else if constexpr (std::is_same_v<T, double> || std::is_same_v<T, Duration>) {
    return with_range("");
  } else if constexpr (std::is_same_v<T, std::string>) {
    return "a text";
  } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return "a file";
  } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    return "a list of texts";
  } else if constexpr (std::is_same_v<T, Transform>) {
    return "a pose";
  } else if constexpr (std::is_same_v<T, Plane>) {
    return "a plane";
  } else {
    return with_range(numbers_in_words<T>());
  }
}

enum class Need : std::uint8_t {
  kOptional,
  kRequired,  ///< in a whole section; a partial one may leave it out
  kSparse,    ///< optional, and written only where it is not zero, empty or the first of its names
};

/// A value that follows none of the rules above. `write` writes the value alone; null: it is never written.
template <class S>
struct OtherValue {
  void (*read)(const ConfigNode& node, const char* key, S& settings);
  void (*write)(YAML::Emitter& out, const S& settings);
  const char* expected;                                     ///< in words
  std::string (*rows)(const std::string& place) = nullptr;  ///< of the keys below it, instead of its own
  bool (*there)(const S& settings) = nullptr;               ///< false: not written
};

/// A key of S, or a mapping of keys.
template <class S>
struct Setting {
  const char* name;  ///< the key
  bool required;
  std::function<void(const ConfigNode&, S&, bool complete)> read;
  std::function<void(YAML::Emitter&, const S&)> write;  ///< key and value; nothing for a value that is not there
  std::function<std::string(const std::string& place, const S& defaults)> rows;

  template <class T, class B>
  requires std::derived_from<S, B> Setting(const char* key, T B::*member, ConfigRange range, const char* meaning,
                                           Need need = Need::kOptional)
      : name(key),
        required(need == Need::kRequired),
        read([=](const ConfigNode& node, S& settings, bool complete) {
          if (node.has(key) || (complete && need == Need::kRequired))
            settings.*member = read_value<T>(node, key, range);
        }),
        write([=](YAML::Emitter& out, const S& settings) {
          if constexpr (kIsOptional<T>)
            if (!(settings.*member)) return;
          if constexpr (std::equality_comparable<T> && kNumbers<T> < 0)
            if (need == Need::kSparse && settings.*member == T{}) return;
          out << YAML::Key << key << YAML::Value;
          write_value(out, key, settings.*member);
        }),
        rows(row(key, meaning, expected_of<T>(range), need, [=](YAML::Emitter& out, const S& defaults) {
          if constexpr (kIsOptional<T>)
            if (!(defaults.*member)) return;
          write_value(out, key, defaults.*member);
        })) {}

  template <class T, class B>
  requires std::derived_from<S, B> Setting(const char* key, T B::*member, const char* meaning,
                                           Need need = Need::kOptional)
      : Setting(key, member, ConfigRange{}, meaning, need) {}

  Setting(const char* key, const OtherValue<S>& other, const char* meaning = "", Need need = Need::kOptional)
      : name(key),
        required(need == Need::kRequired),
        read([=](const ConfigNode& node, S& settings, bool complete) {
          if (node.has(key) || (complete && need == Need::kRequired)) other.read(node, key, settings);
        }),
        write([=](YAML::Emitter& out, const S& settings) {
          if (!other.write || (other.there && !other.there(settings))) return;
          out << YAML::Key << key << YAML::Value;
          other.write(out, settings);
        }),
        rows(other.rows ? [=](const std::string& place, const S&) { return other.rows(place_of(place, key)); }
                        : decltype(rows)(row(key, meaning, other.expected, need, other.write))) {}

  /// The keys of a member, in a mapping below `key`, or beside the others if `key` is empty.
  template <class T, class B>
  requires std::derived_from<S, B> Setting(const char* key, T B::*member, const SettingsTable<T>& table,
                                           Need need = Need::kOptional, YAML::EMITTER_MANIP style = YAML::Block)
      : Setting(
            key, table, [member](auto& settings) -> auto& { return settings.*member; }, need, style) {}

  /// Keys of S itself, or of its base class, in the same way.
  template <class T>
  requires std::derived_from<S, T> Setting(const char* key, const SettingsTable<T>& table, Need need = Need::kOptional)
      : Setting(
            key, table, [](auto& settings) -> auto& { return settings; }, need, YAML::Block) {}

 private:
  static std::string place_of(const std::string& place, const char* key) {
    return place.empty() ? key : place + "." + key;
  }

  template <class T, class Part>
  Setting(const char* key, const SettingsTable<T>& table, Part part, Need need, YAML::EMITTER_MANIP style)
      : name(key),
        required(need == Need::kRequired),
        read([=](const ConfigNode& node, S& settings, bool complete) {
          if (!*key)
            read_settings<T>(node, table, part(settings), complete);
          else if (node.has(key) || (complete && need == Need::kRequired))
            read_settings<T>(node.child(key), table, part(settings), complete);
        }),
        write([=](YAML::Emitter& out, const S& settings) {
          if (!*key) return write_settings<T>(out, table, part(settings));
          out << YAML::Key << key << YAML::Value;
          write_mapping<T>(out, table, part(settings), style);
        }),
        rows([=](const std::string& place, const S& defaults) {
          return settings_rows<T>(*key ? place_of(place, key) : place, table, part(defaults));
        }) {}

  template <class WriteDefault>
  static auto row(const char* key, const char* meaning, const std::string& expected, Need need, WriteDefault write) {
    return [=](const std::string& place, const S& defaults) {
      YAML::Emitter value;
      if constexpr (std::is_pointer_v<WriteDefault>) {
        if (write) write(value, defaults);
      } else {
        write(value, defaults);
      }
      const std::string text = value.c_str();
      const std::string shown = need == Need::kRequired ? "required" : text.empty() || text == "\"\"" ? "none" : text;
      return "| `" + place_of(place, key) + "` | " + shown + " | " + expected + " | " + meaning + " |\n";
    };
  }
};

/// The keys of a mapping, in writing order, and a check across them.
template <class S>
struct SettingsTable {
  std::span<const Setting<S>> rows;
  void (*check)(const ConfigNode& node, const S& settings) = nullptr;  ///< errors: InputError
};

/// Reads the keys of `node`; absent ones keep their values. `complete`: required keys must be there.
/// Errors: InputError with file, line and key.
template <class S>
void read_settings(const ConfigNode& node, const std::type_identity_t<SettingsTable<S>>& table, S& settings,
                   bool complete = true) {
  for (const Setting<S>& setting : table.rows) setting.read(node, settings, complete);
  if (table.check) table.check(node, settings);
}

/// Reads all of `node`: a key in no table is an error too.
template <class S>
S settings_from(const ConfigNode& node, const SettingsTable<S>& table) {
  S settings;
  read_settings(node, table, settings);
  node.finish();
  return settings;
}

/// Writes into an open mapping.
template <class S>
void write_settings(YAML::Emitter& out, const std::type_identity_t<SettingsTable<S>>& table, const S& settings) {
  for (const Setting<S>& setting : table.rows) setting.write(out, settings);
}

template <class S>
void write_mapping(YAML::Emitter& out, const std::type_identity_t<SettingsTable<S>>& table, const S& settings,
                   YAML::EMITTER_MANIP style = YAML::Block) {
  out << style << YAML::BeginMap;
  write_settings(out, table, settings);
  out << YAML::EndMap;
}

/// Rows "| `PLACE.KEY` | default | expected | meaning |" of a Markdown table.
template <class S>
std::string settings_rows(const std::string& place, const std::type_identity_t<SettingsTable<S>>& table,
                          const S& defaults) {
  std::string rows;
  for (const Setting<S>& setting : table.rows) rows += setting.rows(place, defaults);
  return rows;
}
template <class S>
std::string settings_rows(const std::string& place, const SettingsTable<S>& table) {
  return settings_rows(place, table, S{});
}

}  // namespace tankrig
