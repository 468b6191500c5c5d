#include "session/checking/checksums.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/checking/sha256.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "SHA256SUMS";

std::vector<std::string> files_below(const fs::path& session) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(session)) {
    const std::string name = entry.path().lexically_relative(session).generic_string();
    if (entry.is_regular_file() && name != kName && entry.path().extension() != kUnfinished) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> sums_of(const fs::path& session, const std::vector<std::string>& names) {
  std::vector<std::string> sums(names.size());
  tbb::parallel_for(std::size_t{0}, names.size(), [&](std::size_t i) { sums[i] = sha256_of_file(session / names[i]); });
  return sums;
}

/// Name -> sum, as SHA256SUMS has it.
std::map<std::string, std::string> read_sums(const fs::path& session) {
  const std::string text = read_whole_file(session / kName);
  std::map<std::string, std::string> listed;
  int line = 0;
  if (!text.ends_with('\n')) throw InputError(session / kName, "found no line end at its end, expected a whole file");
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const std::string entry = text.substr(begin, end - begin);
    begin = end + 1, ++line;
    if (entry.size() < 67 || entry.find_first_not_of("0123456789abcdef") != 64 || entry.substr(64, 2) != "  ")
      throw InputError(session / kName, line,
                       "found '" + entry + "', expected 64 hexadecimal digits, two blanks and a file name");
    if (!stays_inside(entry.substr(66)))
      throw InputError(session / kName, line, "found '" + entry.substr(66) + "', expected a file of the session");
    listed[entry.substr(66)] = entry.substr(0, 64);
  }
  return listed;
}

}  // namespace

std::string in_words(const ChecksumDifference& difference) {
  using Kind = ChecksumDifference::Kind;
  return difference.file + (difference.kind == Kind::kChanged   ? ": changed"
                            : difference.kind == Kind::kMissing ? ": missing"
                                                                : ": not listed");
}

bool is_derived(const std::string& file) {
  for (const char* folder : {"clouds/", "results/", "pictures/"})
    if (file.starts_with(folder)) return true;
  return file == "report.html";
}

void write_checksums(const fs::path& session) {
  if (!spool_segments(session).empty()) return;
  FileSystemSync disk(session);
  std::map<std::string, std::string> sealed;
  if (fs::exists(session / kName)) sealed = read_sums(session);
  std::erase_if(sealed, [](const auto& entry) { return is_derived(entry.first); });
  std::vector<std::string> names = files_below(session);
  std::erase_if(names, [&](const std::string& name) { return sealed.contains(name); });
  const std::vector<std::string> sums = sums_of(session, names);
  for (std::size_t i = 0; i < names.size(); ++i) sealed[names[i]] = sums[i];
  std::string out;
  for (const auto& [name, sum] : sealed) out += sum + "  " + name + "\n";
  disk.sync();
  write_file_durably(session / kName, out);
}

std::vector<ChecksumDifference> compare_checksums(const fs::path& session) {
  using Kind = ChecksumDifference::Kind;
  std::map<std::string, std::string> listed = read_sums(session);
  const std::vector<std::string> names = files_below(session), sums = sums_of(session, names);
  std::vector<ChecksumDifference> differences;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = listed.find(names[i]);
    if (found == listed.end()) {
      differences.push_back({names[i], Kind::kNotListed});
    } else {
      if (found->second != sums[i]) differences.push_back({names[i], Kind::kChanged});
      listed.erase(found);
    }
  }
  for (const auto& [name, sum] : listed) differences.push_back({name, Kind::kMissing});
  return differences;
}

}  // namespace tankrig
