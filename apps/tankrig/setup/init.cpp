// `tankrig init`: a rig of one's own to edit, complete in one folder.
#include <cstdio>
#include <regex>
#include <sstream>
#include <utility>

#include "apps/tankrig/bench/bench_names.hpp"
#include "apps/tankrig/calibrate/targets.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "pipeline/parameters.hpp"
#include "rig/config/rig_config.hpp"
#include "sim_backends/mock/mock_parameters.hpp"
#include "sim_backends/wire/emulated_tank.hpp"
#include "sim_backends/world/true_rig.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct InitOptions {
  std::filesystem::path directory;
  std::string from = "tank-sim";
  bool keys = false;  ///< print the keys of rig files and make nothing
};

/// `text` with every path in front of the file name `name` removed: "../objects/box.obj" becomes "box.obj".
std::string without_folder(const std::string& text, const std::string& name) {
  const std::string literal = std::regex_replace(name, std::regex(R"([.^$|()\[\]{}*+?\\])"), R"(\$&)");
  return std::regex_replace(text, std::regex(R"([\w./-]*/)" + literal), name);
}

/// The rig file with another name.
std::string named(const std::string& text, const std::string& name) {
  const std::string literal = std::regex_replace(name, std::regex(R"(\$)"), "$$$$");
  return std::regex_replace(text, std::regex(R"((^|\n)name: *[^ #\n]+)"), "$1name: " + literal,
                            std::regex_constants::format_first_only);
}

/// A row of settings_rows(): its cells.
std::vector<std::string> cells(const std::string& row) {
  std::vector<std::string> found;
  std::size_t from = 2;
  for (const std::string bar = " | "; found.size() < 3; from += bar.size()) {
    const std::size_t to = row.find(bar, from);
    found.push_back(row.substr(from, to - from));
    from = to;
  }
  found.push_back(row.substr(from, row.rfind(" |") - from));
  return found;
}

/// What a key may be, and its default: bold if it is one of several words, else behind the semicolon.
std::string allowed(const std::string& standard, const std::string& expected) {
  const std::string bold = "**" + standard + "**";
  if (expected == "true or false") return standard == "true" ? bold + " or false" : "true or " + bold;
  const std::string words = ", " + expected + ", ";
  const std::size_t at = words.find(", " + standard + ", ");
  if (at != std::string::npos) return std::string(expected).replace(at, standard.size(), bold);
  return standard == "none" ? expected : expected + "; " + standard;
}

/// Rows of settings_rows() for people: the place of several keys is said once, and so are keys that mean the same.
std::string grouped(const std::string& rows) {
  std::string out, place, keys, value, meaning;
  const auto put = [&] {
    if (!keys.empty()) out += keys + " | " + value + " | " + meaning + "\n";
    keys.clear();
  };
  std::istringstream lines(rows);
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string> row = cells(line);
    const std::string whole = row[0].substr(1, row[0].size() - 2);
    const std::size_t dot = whole.rfind('.');
    const std::string parent = dot == std::string::npos ? "" : whole.substr(0, dot);
    const std::string key = "`" + whole.substr(dot == std::string::npos ? 0 : dot + 1) + "`";
    const std::string now = allowed(row[1], row[2]);
    if (parent == place && !keys.empty() && now == value && (row[3] == meaning || row[3] == "likewise")) {
      keys += ", " + key;
      continue;
    }
    put();
    if (parent != place) out += "**`" + parent + "`** | |\n";
    place = parent;
    keys = key;
    value = now;
    meaning = row[3];
  }
  put();
  return out;
}

std::string rig_keys() {
  const auto table = [](const char* heading, const std::string& rows) {
    return std::string("## ") + heading + "\nkey | value | meaning\n---|---|---\n" + grouped(rows);
  };
  return table("Rig and scan", rig_key_rows()) + "\n" + table("After the scan", pipeline_key_rows()) + "\n" +
         table("Calibration", settings_rows("targets", kCalibrationTargetKeys)) + "\n" +
         table("Benchmarks", benchmark_key_rows()) + "\n" +
         table("Simulated devices", settings_rows("mock", sim::kMockKeys) + settings_rows("truth", sim::kTrueRigKeys)) +
         "\n" + table("Devices", device_key_rows()) + "\n" + table("Emulated devices", sim::emulation_key_rows());
}

int init(const InitOptions& options) {
  if (options.keys) {
    std::printf("%s", rig_keys().c_str());
    return kOk;
  }
  const fs::path file = find_rig(options.from);
  if (fs::exists(options.directory)) throw InputError(options.directory, "exists already, expected a new folder");
  const ConfigNode root = rig_file(file);
  if (!root.has("scene")) root.fail("scene", "found nothing, expected a scene to start from");
  const fs::path scene = root.path("scene"), mesh = root.child("object").path("mesh");
  const std::string name = yaml_quoted(session_path(options.directory).filename().string());
  UnfinishedFolder made(options.directory);
  const fs::path& building = made.path();
  const auto rig_text = [&](const fs::path& of) {
    return without_folder(without_folder(read_whole_file(of), scene.filename()), mesh.filename());
  };
  std::string as = "rig.yaml", base = "base.yaml";
  for (fs::path of = file; !of.empty(); as = std::exchange(base, "base_of_" + base)) {
    const ConfigNode rig = rig_file(of);
    std::string text = rig_text(of);
    if (rig.has("base")) text = std::regex_replace(text, std::regex(R"((^|\n)base: *[^ #\n]+)"), "$1base: " + base);
    write_file_durably(building / as, of == file ? named(text, name) : text);
    of = rig.has("base") ? fs::path(rig.path("base")) : fs::path();
  }
  write_file_durably(building / scene.filename(), without_folder(read_whole_file(scene), mesh.filename()));
  write_file_durably(building / mesh.filename(), read_whole_file(mesh));
  made.put_in_place();
  std::printf("%s: edit rig.yaml, then  tankrig scan --rig %s\n", options.directory.c_str(), options.directory.c_str());
  return kOk;
}

}  // namespace

void add_init(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("init", "Make a commented rig to start from: rig file, scene and object");
  InitOptions& o = options_of(c, chosen, &init);
  c->footer("Example: tankrig init my-rig && tankrig scan --rig my-rig/rig.yaml");
  auto* what = c->add_option_group("what");
  what->add_option("directory", o.directory, "Folder to make");
  what->add_flag("--keys", o.keys, "Print every key of a rig file: default, range, meaning");
  what->require_option(1);
  c->add_option("--from", o.from, "Rig to copy")->capture_default_str();
}

}  // namespace tankrig::app
