// The descendants of this process and what they use, from /proc.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tankrig {

struct ProcessUse {
  pid_t process = 0;
  double cpu_s = 0;  ///< its own and that of children that it waited for
  std::uint64_t memory_bytes = 0;
};

/// Zombies too: they are processes until somebody waits for them.
std::vector<ProcessUse> descendants();

/// Processes and threads of the user whom this process runs as.
std::size_t tasks_of_user();

}  // namespace tankrig
