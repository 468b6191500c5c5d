// A thread found by its name (PR_SET_NAME), also one of another process.
#pragma once

#include <dirent.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

namespace tankrig::testing_support {

/// The thread of this name, 0 if there is none.
inline pid_t thread_named(pid_t process, const std::string& name) {
  const std::string tasks = "/proc/" + std::to_string(process) + "/task/";
  DIR* const folder = ::opendir(tasks.c_str());
  if (!folder) return 0;
  pid_t thread = 0;
  while (const dirent* entry = ::readdir(folder)) {
    std::string found;
    std::getline(std::ifstream(tasks + entry->d_name + "/comm"), found);
    if (found == name) thread = std::atoi(entry->d_name);
  }
  ::closedir(folder);
  return thread;
}

/// The first process that `parent`'s main thread has started, 0 if there is none.
inline pid_t child_of(pid_t parent) {
  const std::string id = std::to_string(parent);
  pid_t child = 0;
  std::ifstream("/proc/" + id + "/task/" + id + "/children") >> child;
  return child;
}

/// False if there is none.
inline bool signal_thread(pid_t process, const std::string& name, int signal) {
  const pid_t thread = thread_named(process, name);
  return thread != 0 && ::syscall(SYS_tgkill, process, thread, signal) == 0;
}

/// The priority of this process's thread of this name under SCHED_FIFO; nothing if it has another policy, or is none.
inline std::optional<int> fifo_priority(const std::string& name) {
  const pid_t thread = thread_named(::getpid(), name);
  sched_param parameters{};
  if (thread == 0 || ::sched_getscheduler(thread) != SCHED_FIFO || ::sched_getparam(thread, &parameters) != 0)
    return std::nullopt;
  return parameters.sched_priority;
}

}  // namespace tankrig::testing_support
