#include "bench/external/process_tree.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>

namespace fs = std::filesystem;

namespace tankrig {
namespace {

struct Stat {
  pid_t parent = 0;
  std::size_t tasks = 0;
  ProcessUse use;
};

/// /proc/N/stat: pid (name) state ppid ..., utime stime cutime cstime as fields 14 to 17, threads as field 20, rss
/// [pages] as field 24.
std::optional<Stat> stat_of(pid_t process) {
  static const double tick_s = 1.0 / static_cast<double>(::sysconf(_SC_CLK_TCK));
  static const auto page = static_cast<std::uint64_t>(::getpagesize());
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  if (!std::getline(file, text)) return std::nullopt;  // it has ended
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return std::nullopt;
  std::istringstream fields(text.substr(name_end + 1));
  Stat stat;
  stat.use.process = process;
  char state = 0;
  fields >> state >> stat.parent;
  double number = 0;
  for (int field = 5; field <= 24 && fields >> number; ++field) {
    if (field >= 14 && field <= 17) stat.use.cpu_s += number * tick_s;
    if (field == 20) stat.tasks = static_cast<std::size_t>(number);
    if (field == 24) stat.use.memory_bytes = static_cast<std::uint64_t>(number) * page;
  }
  return fields ? std::optional(stat) : std::nullopt;
}

/// Of all processes that have not ended meanwhile.
template <class Visit>
void visit_processes(Visit visit) {
  std::error_code ended;
  for (fs::directory_iterator entry("/proc", ended), end; !ended && entry != end; entry.increment(ended)) {
    const std::string name = entry->path().filename().string();
    pid_t process = 0;
    const auto [rest, wrong] = std::from_chars(name.data(), name.data() + name.size(), process);
    if (wrong != std::errc{} || rest != name.data() + name.size()) continue;
    if (const auto stat = stat_of(process)) visit(*entry, *stat);
  }
}

}  // namespace

std::vector<ProcessUse> descendants() {
  std::map<pid_t, std::vector<Stat>> children;
  visit_processes([&](const fs::directory_entry&, const Stat& stat) { children[stat.parent].push_back(stat); });
  std::vector<ProcessUse> out;
  std::vector<pid_t> parents{::getpid()};
  while (!parents.empty()) {
    const pid_t parent = parents.back();
    parents.pop_back();
    for (const Stat& child : children[parent]) {
      parents.push_back(child.use.process);
      out.push_back(child.use);
    }
  }
  return out;
}

std::size_t tasks_of_user() {
  std::size_t tasks = 0;
  visit_processes([&](const fs::directory_entry& entry, const Stat& process) {
    struct stat owner {};
    if (::stat(entry.path().c_str(), &owner) == 0 && owner.st_uid == ::getuid()) tasks += process.tasks;
  });
  return tasks;
}

}  // namespace tankrig
