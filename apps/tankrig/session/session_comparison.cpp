#include "apps/tankrig/session/session_comparison.hpp"

#include <algorithm>
#include <sstream>

#include "core/csv.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// A table without the columns that `recorded`, an older one, does not have.
std::string with_columns_of(const std::string& recorded, const std::string& table) {
  const std::string header = recorded.substr(0, recorded.find('\n'));
  if (table.starts_with(header + "\n")) return table;
  const std::vector<std::string> known = split_csv_line(header);
  const std::vector<std::string> columns = split_csv_line(table.substr(0, table.find('\n')));
  std::istringstream lines(table);
  std::string out;
  for (std::string line; std::getline(lines, line); out += '\n') {
    const std::vector<std::string> fields = split_csv_line(line);
    const char* between = "";
    for (std::size_t i = 0; i < std::min(fields.size(), columns.size()); ++i) {
      if (std::find(known.begin(), known.end(), columns[i]) == known.end()) continue;
      out += between + csv_field(fields[i]);
      between = ",";
    }
  }
  return out;
}

}  // namespace

std::string difference(const fs::path& recorded, const fs::path& replayed) {
  if (!fs::exists(recorded)) return "is not in the recording";
  if (!fs::exists(replayed)) return "was not made again";
  const std::string extension = recorded.extension();
  const std::string a = read_whole_file(recorded), made = read_whole_file(replayed);
  const std::string b = extension == ".csv" ? with_columns_of(a, made) : made;
  if (a == b) return {};
  const auto [at_a, at_b] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
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
