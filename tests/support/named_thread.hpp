// A thread found by its name (PR_SET_NAME), also one of another process.
#pragma once

#include <dirent.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>

namespace tankrig {

/// Sends `signal` to the thread of this name. False if there is none.
inline bool signal_thread(pid_t process, const std::string& name, int signal) {
  const std::string tasks = "/proc/" + std::to_string(process) + "/task/";
  DIR* const folder = ::opendir(tasks.c_str());
  if (!folder) return false;
  bool sent = false;
  while (const dirent* entry = ::readdir(folder)) {
    std::string found;
    std::getline(std::ifstream(tasks + entry->d_name + "/comm"), found);
    if (found == name) sent = ::syscall(SYS_tgkill, process, std::atoi(entry->d_name), signal) == 0;
  }
  ::closedir(folder);
  return sent;
}

}  // namespace tankrig
