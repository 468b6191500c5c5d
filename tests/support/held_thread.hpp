// A thread of this process that is held up wherever it is, as by a driver that hangs.
#pragma once

#include <dirent.h>
#include <signal.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <string>

namespace tankrig::testing_support {

/// A signal's handler waits in the thread of this name (PR_SET_NAME) until the end of its life. One at a time.
class HeldThread {
 public:
  explicit HeldThread(const std::string& name) {
    held_ = true;
    struct sigaction action {};
    action.sa_handler = wait;
    action.sa_flags = SA_RESTART;
    ::sigaction(SIGUSR2, &action, nullptr);
    for (int look = 0; look < 5000 && !found_; ++look) {  // it may only just begin
      hold(name);
      const timespec pause{0, 1'000'000};
      ::nanosleep(&pause, nullptr);
    }
  }
  ~HeldThread() { held_ = false; }
  HeldThread(const HeldThread&) = delete;
  HeldThread& operator=(const HeldThread&) = delete;

  bool found() const { return found_; }

 private:
  void hold(const std::string& name) {
    DIR* const tasks = ::opendir("/proc/self/task");
    if (!tasks) return;
    while (const dirent* entry = ::readdir(tasks)) {
      std::string found;
      std::getline(std::ifstream(std::string("/proc/self/task/") + entry->d_name + "/comm"), found);
      if (found == name) found_ = ::syscall(SYS_tgkill, ::getpid(), std::atoi(entry->d_name), SIGUSR2) == 0;
    }
    ::closedir(tasks);
  }
  static void wait(int) {
    const timespec pause{0, 1'000'000};
    while (held_) ::nanosleep(&pause, nullptr);
  }

  inline static std::atomic<bool> held_{false};
  bool found_ = false;
};

}  // namespace tankrig::testing_support
