// A control group binds whom it should, root too.
#include "bench/external/task_group.hpp"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "tests/external/own_group.hpp"

namespace tankrig {
namespace {

using testing_support::kNoGroups;
using testing_support::own_group;

constexpr int kMost = 4, kTries = 8;

/// In a process of its own in the group: how many more of kTries it could start that live at the same time.
[[noreturn]] void exit_with_number_started(const TaskGroup& group) {
  group.enter();
  int door[2];
  if (::pipe(door) != 0) ::_exit(kTries + 1);
  int started = 0;
  for (int i = 0; i < kTries; ++i) {
    const pid_t process = ::fork();
    if (process == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::close(door[1]);
      char none = 0;
      ::_exit(static_cast<int>(::read(door[0], &none, 1)));  // until the door is closed
    }
    started += process > 0;
  }
  ::close(door[1]);
  while (::wait(nullptr) > 0) {
  }
  ::_exit(started);
}

TEST(TaskGroup, LetsNoMoreProcessesBeInIt) {
  {
    const TaskGroup group(kMost);
    if (own_group().empty()) GTEST_SKIP() << kNoGroups;
    EXPECT_FALSE(group.refused_some());
    const pid_t first = ::fork();
    ASSERT_GE(first, 0);
    if (first == 0) exit_with_number_started(group);
    int status = 0;
    ASSERT_EQ(::waitpid(first, &status, 0), first);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), kMost - 1) << "beside itself";
    EXPECT_TRUE(group.refused_some());
  }
  EXPECT_TRUE(own_group().empty()) << "nothing of it is left";
}

}  // namespace
}  // namespace tankrig
