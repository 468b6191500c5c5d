#include "rig/guardian/out_of_reach.hpp"

#include <fcntl.h>
#include <mntent.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "drivers/can/owned_descriptor.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr int kLowestScore = -1000, kScoreStep = 50;

/// Where control groups of version 2 are mounted; empty if they are not.
fs::path unified_mount() {
  fs::path found;
  if (FILE* const mounts = ::setmntent("/proc/self/mounts", "r")) {
    while (const mntent* mount = ::getmntent(mounts))
      if (std::string(mount->mnt_type) == "cgroup2") found = mount->mnt_dir;
    ::endmntent(mounts);
  }
  return found;
}

/// This process's group, as a path below the mount.
std::string own_group() {
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);)
    if (line.starts_with("0::/")) return line.substr(4);
  return {};
}

bool write_number(const fs::path& file, long number) {
  const OwnedDescriptor out(::open(file.c_str(), O_WRONLY | O_CLOEXEC));
  const std::string text = std::to_string(number);
  return out && ::write(out.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

}  // namespace

bool leave_the_cgroup() noexcept try {
  const fs::path mount = unified_mount();
  if (mount.empty()) return false;
  const fs::path group = mount / fs::path(own_group()).parent_path() / "tankrig-guardian";
  std::error_code error;
  fs::create_directory(group, error);
  return write_number(group / "cgroup.procs", ::getpid());
} catch (...) {
  return false;
}

bool spare_from_out_of_memory() noexcept try {
  int now = 0;
  std::ifstream("/proc/self/oom_score_adj") >> now;
  for (int score = kLowestScore; score <= now; score += kScoreStep)
    if (write_number("/proc/self/oom_score_adj", score)) return true;
  return false;
} catch (...) {
  return false;
}

}  // namespace tankrig
