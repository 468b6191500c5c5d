// Settings said once: a table names each key, where its value lies, its range and its meaning. What reads them, writes
// them and documents them follows from it.
#pragma once

#include <yaml-cpp/emitter.h>
#include <yaml-cpp/emittermanip.h>

#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "core/config_node.hpp"
#include "core/model_yaml.hpp"
#include "core/text_files.hpp"
#include "core/time.hpp"

namespace tankrig {

/// A value that is neither a number, a count, a flag, a time nor one number a joint.
template <class S>
struct OtherValue {
  void (*read)(const ConfigNode& node, const char* key, S& settings);
  void (*write)(YAML::Emitter& out, const S& settings);
  const char* expected;  ///< in words
};

/// A key of S. Values are SI in memory; a key that ends in _ms or _mm stands for thousandths of that.
template <class S>
struct Setting {
  const char* key;
  std::variant<double S::*, int S::*, bool S::*, Duration S::*, JointVector S::*, OtherValue<S>> value;
  ConfigRange range;  ///< of numbers, as they stand in the file
  const char* meaning;
  bool required = false;  ///< in a whole section; what changes one may leave it out
};

/// A number of the file in SI, and back, by the unit that its key ends with.
constexpr bool in_thousandths(std::string_view key) { return key.ends_with("_ms") || key.ends_with("_mm"); }
constexpr double to_si(std::string_view key, double number) { return in_thousandths(key) ? 1e-3 * number : number; }
constexpr double from_si(std::string_view key, double si) { return in_thousandths(key) ? 1e3 * si : si; }

/// Reads the keys of `node`; those that are not there keep their values. `complete`: what is required must be there.
/// Errors: InputError with file, line and key.
template <class S>
void read_settings(const ConfigNode& node, std::span<const Setting<S>> table, S& settings, bool complete = false) {
  for (const Setting<S>& setting : table) {
    const char* key = setting.key;
    if (!node.has(key) && !(complete && setting.required)) continue;
    struct Reader {
      const ConfigNode& node;
      const Setting<S>& setting;
      S& settings;
      double number() const { return node.number(setting.key, setting.range); }
      void operator()(double S::*member) const { settings.*member = to_si(setting.key, number()); }
      void operator()(int S::*member) const { settings.*member = node.integer(setting.key, setting.range); }
      void operator()(bool S::*member) const { settings.*member = node.flag(setting.key); }
      void operator()(Duration S::*member) const { settings.*member = from_seconds(to_si(setting.key, number())); }
      void operator()(JointVector S::*member) const {
        const JointVector read = read_joints(node, setting.key);
        if (read.minCoeff() < setting.range.lower || read.maxCoeff() > setting.range.upper)
          node.fail(setting.key, "found " + yaml_of(read) + ", expected five numbers from " +
                                     exact_text(setting.range.lower) + " to " + exact_text(setting.range.upper));
        settings.*member = read;
      }
      void operator()(const OtherValue<S>& other) const { other.read(node, setting.key, settings); }
    };
    std::visit(Reader{node, setting, settings}, setting.value);
  }
}

/// Into a block mapping that is open.
template <class S>
void write_settings(YAML::Emitter& out, std::span<const Setting<S>> table, const S& settings) {
  for (const Setting<S>& setting : table) {
    struct Writer {
      YAML::Emitter& out;
      const Setting<S>& setting;
      const S& settings;
      void put(double si) const { out << exact_text(from_si(setting.key, si)); }
      void operator()(double S::*member) const { put(settings.*member); }
      void operator()(int S::*member) const { out << settings.*member; }
      void operator()(bool S::*member) const { out << settings.*member; }
      void operator()(Duration S::*member) const { put(seconds(settings.*member)); }
      void operator()(JointVector S::*member) const {
        out << YAML::Flow << YAML::BeginSeq;
        for (const double q : settings.*member) out << exact_text(q);
        out << YAML::EndSeq;
      }
      void operator()(const OtherValue<S>& other) const { other.write(out, settings); }
    };
    out << YAML::Key << setting.key << YAML::Value;
    std::visit(Writer{out, setting, settings}, setting.value);
  }
}

/// Rows "| `SECTION.KEY` | default | expected | meaning |" of a Markdown table, with `defaults` as the defaults.
template <class S>
std::string settings_rows(const std::string& section, std::span<const Setting<S>> table, const S& defaults) {
  std::string rows;
  for (const Setting<S>& setting : table) {
    YAML::Emitter value;
    value << YAML::BeginMap;
    write_settings(value, std::span<const Setting<S>>(&setting, 1), defaults);
    value << YAML::EndMap;
    const std::string text = value.c_str();
    const std::string shown = setting.required ? "required" : text.substr(text.find(": ") + 2);
    struct Words {
      const Setting<S>& setting;
      std::string range() const { return exact_text(setting.range.lower) + " to " + exact_text(setting.range.upper); }
      std::string operator()(double S::*) const { return range(); }
      std::string operator()(Duration S::*) const { return range(); }
      std::string operator()(int S::*) const { return range() + ", whole"; }
      std::string operator()(bool S::*) const { return "true or false"; }
      std::string operator()(JointVector S::*) const { return "five of " + range(); }
      std::string operator()(const OtherValue<S>& other) const { return other.expected; }
    };
    rows += "| `" + section + "." + setting.key + "` | " + shown + " | " + std::visit(Words{setting}, setting.value) +
            " | " + setting.meaning + " |\n";
  }
  return rows;
}

}  // namespace tankrig
