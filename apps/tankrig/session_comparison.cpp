#include "apps/tankrig/session_comparison.hpp"

#include <algorithm>

#include "rig/session/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {

std::string difference(const fs::path& recorded, const fs::path& replayed) {
  if (!fs::exists(recorded)) return "is not in the recording";
  if (!fs::exists(replayed)) return "was not made again";
  const std::string a = read_whole_file(recorded), b = read_whole_file(replayed);
  if (a == b) return {};
  const auto [at_a, at_b] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  const std::string extension = recorded.extension();
  if (extension == ".csv" || extension == ".json" || extension == ".yaml")
    return "line " + std::to_string(1 + std::count(a.begin(), at_a, '\n')) + " differs";
  return "byte " + std::to_string(at_a - a.begin()) + " differs";
}

std::vector<std::string> files_of(const fs::path& session) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(session))
    if (entry.is_regular_file()) names.push_back(fs::relative(entry.path(), session).generic_string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace tankrig::app
