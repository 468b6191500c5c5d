// The control group that this process has made for what it runs, as the kernel shows it.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>

#include "bench/external/task_group.hpp"

namespace tankrig::testing_support {

inline constexpr const char* kNoGroups = "this user may make no control groups";

/// Empty: there is none.
inline std::filesystem::path own_group() {
  for (const std::filesystem::path mount : {"/sys/fs/cgroup/pids", "/sys/fs/cgroup"})
    if (const auto path = mount / ("tankrig-" + std::to_string(::getpid())); std::filesystem::exists(path)) return path;
  return {};
}

inline bool may_make_groups() {
  const TaskGroup group(1);
  return !own_group().empty();
}

}  // namespace tankrig::testing_support
