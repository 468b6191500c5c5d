// A thread of a child process that is stopped wherever it is, while the others go on: as by a driver that hangs.
#pragma once

#include <sys/ptrace.h>
#include <sys/wait.h>

#include <cerrno>
#include <string>

#include "tests/support/named_thread.hpp"

namespace tankrig::testing_support {

/// Once for a child. Its process ends only when gone() has been asked.
class FrozenThread {
 public:
  /// The thread of this name (PR_SET_NAME).
  void freeze(pid_t process, const std::string& name) {
    thread_ = thread_named(process, name);
    if (thread_ == 0) return;
    if (::ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) != 0) {
      forbidden_ = errno == EPERM;
      return;
    }
    int status = 0;
    frozen_ = ::ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0 &&
              ::waitpid(thread_, &status, __WALL) == thread_ && WIFSTOPPED(status);
  }

  bool forbidden() const { return forbidden_; }
  bool frozen() const { return frozen_; }

  /// It died with its process.
  bool gone() {
    int status = 0;
    if (frozen_ && ::waitpid(thread_, &status, __WALL | WNOHANG) == thread_ && !WIFSTOPPED(status)) frozen_ = false;
    return !frozen_;
  }

 private:
  pid_t thread_ = 0;
  bool forbidden_ = false, frozen_ = false;
};

}  // namespace tankrig::testing_support
