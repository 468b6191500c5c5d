// A stranger's program in the sandbox: what it makes comes out, and it reaches nothing else.
#include "bench/external/sandbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

#include "bench/external/limited_run.hpp"
#include "bench/external/process_tree.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SandboxTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (::access("/usr/bin/bwrap", X_OK) != 0) GTEST_SKIP() << "skipped: no bubblewrap";
    fs::create_directory(folder_.path() / "given");
    fs::permissions(folder_.path(), fs::perms(0755));
    if (std::system("/usr/bin/bwrap --unshare-all --ro-bind / / true") != 0)
      GTEST_SKIP() << "skipped: bubblewrap gets no namespaces here";
    ASSERT_EQ(end_of("true"), "") << last_words(run_);
  }
  std::string end_of(const std::string& script, RunLimits limits = {}) {
    const fs::path program = folder_.write("given/program", "#!/bin/sh\n" + script + "\n"),
                   work = folder_.path() / "work", result = folder_.write("result", "");
    ::chmod(program.c_str(), 0755);
    ::chmod(result.c_str(), 0666);
    fs::create_directories(work);
    limits.wall_s = std::min(limits.wall_s, 20.0);
    run_ = {sandboxed({{folder_.path() / "given"}, work, 8 << 20, work / "made", result}, {program.string()}),
            folder_.path(), limits};
    const std::string end = supervise(run_, -1);
    EXPECT_THAT(descendants(), IsEmpty()) << script;
    return end;
  }

  TemporaryFolder folder_;
  LimitedRun run_;
};

TEST_F(SandboxTest, KeepsWhatTheProgramMakes) {
  EXPECT_EQ(end_of("echo a cloud > made; echo other > else"), "");
  EXPECT_EQ(folder_.read("result"), "a cloud\n");
  EXPECT_THAT(fs::is_empty(folder_.path() / "work"), true);
  EXPECT_EQ(end_of("true"), "");
  EXPECT_EQ(folder_.read("result"), "");
  EXPECT_EQ(end_of("echo half > made; exit 7"), "exit code 7");
  EXPECT_EQ(folder_.read("result"), "");
}

TEST_F(SandboxTest, HidesThisMachine) {
  folder_.write("secret", "secret");
  const std::string secret = (folder_.path() / "secret").string();
  for (const std::string& file : {std::string("/etc/passwd"), std::string("/root"), std::string("/home"),
                                  std::string("/var"), std::string("/sys"), std::string("/run"), secret})
    EXPECT_EQ(end_of("test ! -e " + file), "") << file;
  EXPECT_EQ(end_of("test \"$(ls /proc | grep -c '^[0-9]*$')\" -lt 8"), "");
  EXPECT_EQ(end_of("test -r \"$0\" && test -n \"$HOME\" && cd \"$HOME\""), "");
}

TEST_F(SandboxTest, LetsNothingBeChanged) {
  for (const std::string& script :
       {std::string("echo x >> \"$0\""), std::string("touch /usr/x"), std::string("touch /x"),
        "touch " + (folder_.path() / "given/x").string(), std::string("chmod 777 \"$0\""),
        std::string("mount -t tmpfs none /usr"), std::string("unshare -U true"), std::string("unshare -m true")})
    EXPECT_NE(end_of(script), "") << script;
  EXPECT_FALSE(fs::exists(folder_.path() / "given/x"));
}

TEST_F(SandboxTest, HasNoNetwork) {
  EXPECT_EQ(end_of("test \"$(grep -c : /proc/net/dev)\" -eq 1 && grep -q lo: /proc/net/dev"), "");
  EXPECT_NE(end_of("python3 -c 'import socket; socket.create_connection((\"1.1.1.1\", 53), 2)'"), "");
}

TEST_F(SandboxTest, IsNobodyWithoutRights) {
  EXPECT_EQ(end_of("grep -q 'CapEff:.0000000000000000' /proc/self/status && grep -q 'NoNewPrivs:.1' /proc/self/status"),
            "");
  const uid_t expected = ::geteuid() == 0 ? 65534 : ::geteuid();
  EXPECT_EQ(end_of("test $(id -u) -eq " + std::to_string(expected)), "");
}

TEST_F(SandboxTest, EndsAForkBomb) {
  EXPECT_THAT(end_of("b() { b | b & }; b; sleep 10", {.processes = 16}),
              AnyOf(HasSubstr("processes"), HasSubstr("ran longer"), HasSubstr("exit code")));
}

TEST_F(SandboxTest, GivesItsFolderNoMoreThanIsSaid) {
  EXPECT_NE(end_of("dd if=/dev/zero of=big bs=1M count=9"), "");
  EXPECT_NE(
      end_of(
          "mkdir hidden && for i in 1 2 3 4 5 6 7 8 9; do dd if=/dev/zero of=hidden/$i bs=1M count=1 || exit 1; done"),
      "");
  EXPECT_EQ(end_of("dd if=/dev/zero of=made bs=1M count=7"), "");
}

TEST_F(SandboxTest, LeavesNothingThatRuns) {
  EXPECT_EQ(end_of("setsid sleep 600 & setsid sh -c 'trap \"\" TERM; sleep 600' & echo done > made"), "");
  EXPECT_EQ(folder_.read("result"), "done\n");
}

}  // namespace
}  // namespace tankrig
