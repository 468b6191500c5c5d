// Programs that behave badly: each is ended, named, and leaves nothing behind.
#include "bench/external/limited_run.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>

#include "bench/external/process_tree.hpp"
#include "core/shown_text.hpp"
#include "tests/external/own_group.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;

/// A shell script as the program.
class LimitedRunTest : public ::testing::Test {
 protected:
  std::string end_of(const std::string& script, const RunLimits& limits = {}) {
    const auto program = folder_.write("program", "#!/bin/sh\n" + script + "\n");
    ::chmod(program.c_str(), 0755);
    for (const char* before : {"work", "output.txt"}) std::filesystem::remove_all(folder_.path() / before);
    std::filesystem::create_directories(folder_.path() / "work");
    run_ = {{program.string(), "one", "two words"}, folder_.path(), limits};
    const std::string end = supervise(run_, -1);
    EXPECT_THAT(descendants(), IsEmpty()) << script;
    return end;
  }

  TemporaryFolder folder_;
  LimitedRun run_;
};

TEST_F(LimitedRunTest, RunsAProgramWithItsArgumentsInItsFolder) {
  EXPECT_EQ(end_of("echo \"$1|$2|$#|$(pwd)|$TMPDIR|$(cat | wc -c)\" > said"), "");
  const std::string work = (folder_.path() / "work").string();
  EXPECT_EQ(folder_.read("work/said"), "one|two words|2|" + work + "|" + work + "|0\n");
}

TEST_F(LimitedRunTest, SaysHowItFailed) {
  EXPECT_EQ(end_of("echo no such picture >&2; exit 3"), "exit code 3");
  EXPECT_EQ(last_words(run_), "no such picture");
  EXPECT_THAT(end_of("kill -SEGV $$"), HasSubstr("killed by signal 11"));
  run_.command.front() = (folder_.path() / "gone").string();
  EXPECT_EQ(supervise(run_, -1), "cannot be run: No such file or directory");
  std::filesystem::remove(folder_.path() / "work");
  EXPECT_EQ(supervise(run_, -1), "cannot be run: No such file or directory");
}

TEST_F(LimitedRunTest, EndsOneThatHangsEvenIfItIgnoresSignals) {
  EXPECT_EQ(end_of("trap '' TERM INT HUP; while :; do sleep 1000; done", {.wall_s = 0.3}), "ran longer than 0.3 s");
}

TEST_F(LimitedRunTest, EndsOneThatComputesInManyProcesses) {
  EXPECT_EQ(end_of("(while :; do :; done) & (while :; do :; done) & wait", {.wall_s = 60, .cpu_s = 0.5}),
            "took more than 0.5 s of processor time");
}

TEST_F(LimitedRunTest, EndsAForkBombAndOneThatLeavesItsGroup) {
  EXPECT_THAT(end_of("bomb() { bomb | bomb & }; bomb; sleep 1000", {.processes = 20}),
              MatchesRegex("had [0-9]+ processes, expected at most 20"));
  EXPECT_THAT(end_of("i=0; while [ $i -lt 200 ]; do i=$((i + 1)); sleep 1000 & done; sleep 1000", {.processes = 20}),
              MatchesRegex("had [0-9]+ processes, expected at most 20"))
      << "its shell ends when it may start no more";
  EXPECT_EQ(end_of("for i in 1 2 3; do setsid sleep 1000 & done; (setsid sleep 1000 &); exit 0"), "");
}

TEST_F(LimitedRunTest, RunsInAGroupThatBoundsItsProcesses) {
  if (!testing_support::may_make_groups()) GTEST_SKIP() << testing_support::kNoGroups;
  const RunLimits limits{.processes = 20};
  ASSERT_EQ(
      end_of("group=$(sed -n 's|.*/\\(tankrig-[0-9]*\\)$|\\1|p' /proc/self/cgroup); test -n \"$group\" || exit 1\n"
             "cat /sys/fs/cgroup/pids/$group/pids.max > most || cat /sys/fs/cgroup/$group/pids.max > most",
             limits),
      "");
  const int most = std::stoi(folder_.read("work/most"));
  EXPECT_GT(most, limits.processes) << "it is seen to have too many";
  EXPECT_LE(most, limits.processes + 64);
}

TEST_F(LimitedRunTest, EndsOneThatFillsTheDisk) {
  const RunLimits limits{.disk_bytes = 4 << 20};
  EXPECT_EQ(end_of("exec cat /dev/zero > big", limits), "wrote more than 4 MiB");
  EXPECT_LE(std::filesystem::file_size(folder_.path() / "work/big"), limits.disk_bytes);
  EXPECT_EQ(end_of("i=0; while :; do i=$((i + 1)); head -c 1000000 /dev/zero > small$i; done", limits),
            "wrote more than 4 MiB");
}

TEST_F(LimitedRunTest, CountsWhatItPrintsEmptyFilesAndFilesOfItsChildren) {
  const RunLimits limits{.disk_bytes = 1 << 20};
  EXPECT_EQ(end_of("exec yes", limits), "wrote more than 1 MiB");
  EXPECT_EQ(end_of("yes; exit 1", limits), "wrote more than 1 MiB");
  EXPECT_LE(std::filesystem::file_size(folder_.path() / "output.txt"), limits.disk_bytes);
  EXPECT_EQ(end_of("i=0; while :; do i=$((i + 1)); mkdir -p d$((i / 9)); : > d$((i / 9))/f$i; done", limits),
            "wrote more than 1 MiB");
}

TEST_F(LimitedRunTest, CountsWhatLiesBesideFilesThatVanish) {
  EXPECT_EQ(end_of("mkdir a z; (cd a; while :; do mkdir b; rmdir b; done) &\n"
                   "cd z; i=0; while :; do i=$((i + 1)); head -c 100000 /dev/zero > small$i; done",
                   {.wall_s = 20, .disk_bytes = 8 << 20}),
            "wrote more than 8 MiB");
}

TEST_F(LimitedRunTest, EndsOneThatHidesWhatItWrites) {
  // Folders deeper than any path can name; their names are the bytes.
  EXPECT_EQ(end_of("exec python3 -c 'import os\nfor i in range(40): os.mkdir(\"d\" * 200); os.chdir(\"d\" * 200)'"),
            "wrote more than 256 MiB");
  if (::geteuid() == 0) return;  // who reads everything
  EXPECT_EQ(end_of("mkdir d; echo hidden > d/f; chmod 0 d"), "wrote more than 256 MiB");
}

TEST_F(LimitedRunTest, CountsProcessesThatNobodyWaitedFor) {
  EXPECT_THAT(end_of("for i in $(seq 40); do sleep 0 & done; exec sleep 1000", {.processes = 20}),
              MatchesRegex("had [0-9]+ processes, expected at most 20"));
}

TEST_F(LimitedRunTest, LeavesAUserFewMoreTasksWhateverABombDoes) {
  EXPECT_EQ(end_of("test $(sed -n 's/^Max processes *\\([0-9]*\\) .*/\\1/p' /proc/self/limits) -lt 100000"), "");
}

TEST_F(LimitedRunTest, HidesAFolderInItsWordsWhereverTheyAreCut) {
  const std::string inside = (folder_.path() / "work").string() + "/";
  for (std::size_t before = 190 - inside.size(); before < 200; ++before) {
    EXPECT_EQ(end_of("echo " + std::string(before, 'x') + inside + "run; exit 1"), "exit code 1");
    EXPECT_EQ(last_words(run_, folder_.path() / "work"), shown_text(std::string(before, 'x') + "run", 200));
  }
}

TEST_F(LimitedRunTest, ReadsNoWordsFromAPipe) {
  EXPECT_EQ(end_of("rm ../output.txt; mkfifo ../output.txt; exit 1"), "exit code 1");
  EXPECT_EQ(last_words(run_), "");
}

TEST_F(LimitedRunTest, EndsOneThatFillsTheMemory) {
  TANKRIG_SKIP_SANITIZED("limits memory");
  const RunLimits limits{.memory_bytes = 64 << 20};
  EXPECT_EQ(end_of("test $(ulimit -v) = 65536", limits), "");
  EXPECT_NE(end_of("tail /dev/zero", limits), "");
  EXPECT_EQ(
      end_of("for i in 1 2 3 4; do (head -c 40000000 /dev/zero | tail -c 40000000 | (sleep 1000; cat)) & done; wait",
             limits),
      "took more than 64 MiB of memory");
}

TEST_F(LimitedRunTest, EndsWithItsCaller) {
  int alive[2];
  ASSERT_EQ(::pipe(alive), 0);
  end_of("exit 0");
  run_.command = {"/bin/sleep", "1000"};
  ::close(alive[1]);
  EXPECT_EQ(supervise(run_, alive[0]), "was stopped");
  ::close(alive[0]);
  EXPECT_THAT(descendants(), IsEmpty());
}

}  // namespace
}  // namespace tankrig
