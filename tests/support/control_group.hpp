// A control group of its own for a process, which can be frozen.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace tankrig::testing_support {

class ControlGroup {
 public:
  explicit ControlGroup(pid_t process) {
    for (const std::filesystem::path mount : {"/sys/fs/cgroup", "/sys/fs/cgroup/unified"}) {
      std::error_code error;
      path_ = mount / ("tankrig-test-" + std::to_string(::getpid()));
      if (!std::filesystem::exists(mount / "cgroup.procs", error) || !std::filesystem::create_directory(path_, error))
        continue;
      reachable_ = std::filesystem::exists(path_ / "cgroup.freeze", error) && write("cgroup.procs", process);
      if (reachable_) return;
      std::filesystem::remove(path_, error);
    }
  }
  /// The process has ended by then.
  ~ControlGroup() { ::rmdir(path_.c_str()); }
  ControlGroup(const ControlGroup&) = delete;
  ControlGroup& operator=(const ControlGroup&) = delete;

  /// This user may make groups of version 2 here, and freeze them.
  bool reachable() const { return reachable_; }
  /// All its processes at once.
  bool kill() { return write("cgroup.kill", 1); }
  bool freeze(bool on) { return write("cgroup.freeze", on ? 1 : 0); }

 private:
  bool write(const char* file, long number) {
    std::ofstream out(path_ / file);
    out << number << std::flush;
    return out.good();
  }

  std::filesystem::path path_;
  bool reachable_ = false;
};

}  // namespace tankrig::testing_support
