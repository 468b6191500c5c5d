// The include rule, line by line.
#include "tests/architecture/include_rule.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string_view>

namespace tankrig::testing {
namespace {

struct Rule {
  std::string folder;
  std::vector<std::string> may_include;
};

const std::vector<Rule>& rules() {
  static const std::vector<Rule> table = {
      {"core", {"core"}},
      {"drivers", {"core", "drivers"}},
      {"sim_backends/world", {"core", "drivers", "sim_backends/world"}},
      {"sim_backends", {"core", "drivers", "sim_backends"}},
      {"rig/platform", {"core", "drivers", "rig/platform"}},
      {"rig/safety", {"core", "drivers", "rig/safety"}},
      {"rig/guardian", {"core", "drivers", "rig/safety", "rig/guardian"}},
      {"rig/sync", {"core", "drivers", "rig/sync"}},
      {"rig/plan", {"core", "drivers", "rig/platform", "rig/safety", "rig/sync", "rig/plan"}},
      {"rig/config", {"core", "rig/plan", "rig/config"}},
      {"rig/executive", {"core", "drivers", "rig/plan", "rig/platform", "rig/safety", "rig/executive"}},
      {"rig/capture",
       {"core", "drivers", "session", "rig/config", "rig/executive", "rig/plan", "rig/safety", "rig/sync",
        "rig/capture"}},
      {"rig/scan",
       {"core", "drivers", "session", "rig/capture", "rig/config", "rig/executive", "rig/plan", "rig/platform",
        "rig/scan"}},
      {"rig/commission",
       {"core", "drivers", "session", "rig/capture", "rig/config", "rig/plan", "rig/safety", "rig/scan",
        "rig/commission"}},
      {"session/export", {"core", "drivers", "session"}},
      {"session", {"core", "session/recording", "session/reading", "session/checking", "session/import"}},
      {"calibration", {"core", "calibration"}},
      {"reconstruction", {"core", "reconstruction"}},
      {"bench", {"core", "reconstruction", "bench"}},
      {"pipeline", {"core", "session", "reconstruction", "bench", "pipeline"}},
      {"console/feed", {"console/feed"}},
      {"console", {"core", "session", "console"}},
      {"examples", {"core", "session", "calibration", "reconstruction", "bench", "pipeline", "examples"}},
      {"apps",
       {"core", "drivers", "sim_backends", "session", "rig", "calibration", "reconstruction", "bench", "pipeline",
        "console", "apps"}},
      {"tests",
       {"core", "drivers", "sim_backends", "session", "rig", "calibration", "reconstruction", "bench", "pipeline",
        "console", "tests"}},
  };
  return table;
}

bool is_below(const std::string& path, const std::string& folder) { return path.rfind(folder + "/", 0) == 0; }

const Rule* rule_of(const std::string& path) {
  const auto rule =
      std::find_if(rules().begin(), rules().end(), [&](const Rule& r) { return is_below(path, r.folder); });
  return rule == rules().end() ? nullptr : &*rule;
}

std::string joined(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : ", ") + word;
  return line;
}

bool is_source(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".hpp" || extension == ".cpp" || extension == ".h" || extension == ".cc" || extension == ".c";
}

/// A comment; or, in a .cpp, the header of the same name (without `_test`), whose first line says it.
bool says_what_lives_there(const std::string& file, const std::string& first_line) {
  if (first_line.rfind("//", 0) == 0) return true;
  const std::filesystem::path path(file);
  if (path.extension() != ".cpp") return false;
  std::string name = path.stem().string();
  constexpr std::string_view kTest = "_test";
  if (name.size() > kTest.size() && name.ends_with(kTest)) name.resize(name.size() - kTest.size());
  return first_line.rfind("#include \"", 0) == 0 && first_line.ends_with("/" + name + ".hpp\"");
}

bool is_left_out(const std::string& folder) {
  return folder.front() == '.' || folder.rfind("build", 0) == 0 || folder == "sessions";
}

}  // namespace

Violations check_source(const std::string& file, const std::string& text, const Exists& exists) {
  static const std::regex include(R"(^\s*#\s*include\s*(["<])([^">]+)[">].*)");
  Violations found;
  const auto report = [&](int line, const std::string& message) {
    found.push_back(file + ":" + std::to_string(line) + ": " + message);
  };
  const Rule* rule = rule_of(file);
  if (rule == nullptr) report(1, "a source outside the folders of the include rule");

  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (number == 1 && !says_what_lives_there(file, line))
      report(1, "the first line says neither, after //, what lives there nor, in a .cpp, which header does");
    std::smatch match;
    if (!std::regex_match(line, match, include)) continue;
    const bool quoted = match[1] == "\"";
    const std::string path = match[2];
    if (quoted && !exists(path)) {
      report(number, "includes \"" + path + "\", which is no path from the root");
      continue;
    }
    if (!exists(path)) continue;
    if (!quoted) report(number, "includes <" + path + ">, a file of ours, without quotes");
    if (rule == nullptr) continue;
    const bool allowed = std::any_of(rule->may_include.begin(), rule->may_include.end(),
                                     [&](const std::string& folder) { return is_below(path, folder); });
    if (!allowed)
      report(number, "includes " + path + ", but " + rule->folder + " may include only " + joined(rule->may_include));
  }
  if (text.empty()) report(1, "an empty source");
  return found;
}

std::vector<std::string> sources_of(const std::filesystem::path& root) {
  std::vector<std::string> sources;
  for (const auto& top : std::filesystem::directory_iterator(root)) {
    if (top.is_regular_file() && is_source(top.path())) sources.push_back(top.path().filename().string());
    if (!top.is_directory() || is_left_out(top.path().filename().string())) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(top.path()))
      if (entry.is_regular_file() && is_source(entry.path()))
        sources.push_back(entry.path().lexically_relative(root).generic_string());
  }
  std::sort(sources.begin(), sources.end());
  return sources;
}

Violations check_tree(const std::filesystem::path& root) {
  const Exists exists = [&](const std::string& path) { return std::filesystem::is_regular_file(root / path); };
  Violations all;
  for (const std::string& file : sources_of(root)) {
    std::ifstream stream(root / file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    const Violations found = check_source(file, text, exists);
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

}  // namespace tankrig::testing
