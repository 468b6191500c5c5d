#include "apps/tankrig/command_line/rig_files.hpp"

#include <algorithm>

#include "core/input_error.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Folders that hold rigs, nearest first: of the working directory, of the source tree around the build, of the
/// installation.
std::vector<fs::path> rig_folders() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  return {fs::current_path() / "etc/rigs", program / "../../etc/rigs", program / "../share/tankrig/rigs"};
}

}  // namespace

std::vector<std::string> known_rigs() {
  std::error_code ignored;
  std::vector<std::string> known;
  for (const fs::path& folder : rig_folders())
    for (const auto& entry : fs::directory_iterator(folder, ignored))
      if (fs::exists(entry.path() / "rig.yaml", ignored)) known.push_back(entry.path().filename().string());
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  return known;
}

fs::path find_rig(const std::string& name_or_path) {
  std::error_code ignored;
  const fs::path path = name_or_path;
  if (fs::is_directory(path, ignored) && fs::exists(path / "rig.yaml", ignored)) return fs::absolute(path / "rig.yaml");
  if (fs::is_regular_file(path, ignored)) return fs::absolute(path);
  for (const fs::path& folder : rig_folders()) {
    const fs::path candidate = folder / path / "rig.yaml";
    if (fs::exists(candidate, ignored)) return fs::weakly_canonical(candidate);
  }
  std::string list;
  for (const std::string& name : known_rigs()) list += (list.empty() ? "" : ", ") + name;
  if (list.empty()) list = "(no rigs beside the working directory or the program)";
  throw InputError("rig '" + name_or_path + "' not found, expected a rig.yaml, its folder, or one of: " + list);
}

}  // namespace tankrig::app
