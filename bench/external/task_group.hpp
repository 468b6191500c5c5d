// A control group that bounds how many processes and threads a program can have: RLIMIT_NPROC does not bind root.
#pragma once

#include <filesystem>

namespace tankrig {

/// Of version 1 (pids) or 2. Where this user may not make one, it bounds nothing.
class TaskGroup {
 public:
  explicit TaskGroup(int most);
  /// What was in it has ended by then.
  ~TaskGroup();
  TaskGroup(const TaskGroup&) = delete;
  TaskGroup& operator=(const TaskGroup&) = delete;

  /// In a child: it, and what it starts, is bound from now on. Only system calls.
  void enter() const noexcept;
  /// More were wanted than it lets in.
  bool refused_some() const noexcept;

 private:
  std::filesystem::path path_;
  int processes_ = -1;  ///< its cgroup.procs
};

}  // namespace tankrig
