// A part of a test in a process of its own: to be killed, or to do what one process cannot do twice.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <functional>

namespace tankrig {

/// Starts `action` in a child; its exit code is 0 unless an expectation failed in it or it threw. The caller has no
/// threads of its own.
inline pid_t start_child(const std::function<void()>& action) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child != 0) return child;
  int code = 0;
  try {
    action();
    code = testing::Test::HasFailure() ? 1 : 0;
  } catch (const std::exception& e) {
    std::printf("child: %s\n", e.what());
    code = 2;
  }
  std::fflush(nullptr);
  ::_exit(code);
}

/// How it ended, as waitpid() tells.
inline int wait_for_child(pid_t child) {
  int status = -1;
  ::waitpid(child, &status, 0);
  return status;
}

inline void in_child(const std::function<void()>& action) {
  const int status = wait_for_child(start_child(action));
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
}

}  // namespace tankrig
