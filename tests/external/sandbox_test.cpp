// A stranger's program in the sandbox: what it makes comes out, and it reaches nothing else.
#include "bench/external/sandbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <sstream>

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
    run_ = {sandboxed({{folder_.path() / "given"}, work, 8 << 20, work / "made", result, folder_.path() / "filter"},
                      {program.string()}),
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
  EXPECT_EQ(end_of("test ! -e /proc/self/fd/3"), "");
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

/// Makes each call, NAME=NUMBER, and prints what became of it. Arguments that no call takes, but those after a number.
constexpr const char* kCaller = R"(import ctypes, errno, os, sys
call = ctypes.CDLL(None, use_errno=True).syscall
for word in sys.argv[1:]:
    name, numbers = word.split('=')
    number, *given = map(int, numbers.split(','))
    ctypes.set_errno(0)
    made = call(ctypes.c_long(number), *[ctypes.c_long(a) for a in (given + 6 * [-1])[:6]])
    if name.startswith('clone') and made == 0: os._exit(0)
    print(name, 'done' if made >= 0 else errno.errorcode[ctypes.get_errno()])
)";

std::map<std::string, std::string> words_by_name(const std::string& text) {
  std::map<std::string, std::string> found;
  std::istringstream lines(text);
  for (std::string name, word; lines >> name >> word;) found[name] = word;
  return found;
}

TEST_F(SandboxTest, HasNoCallsThatAComputationNeverMakes) {
  const std::map<std::string, std::vector<long>> calls{
      {"add_key", {SYS_add_key}},
      {"bpf", {SYS_bpf}},
      {"chroot", {SYS_chroot}},
      {"clock_settime", {SYS_clock_settime}},
      {"clone3", {SYS_clone3, 0, 0}},
      {"clone, network", {SYS_clone, CLONE_NEWNET | SIGCHLD, 0, 0, 0, 0}},
      {"clone, mounts", {SYS_clone, CLONE_NEWNS | SIGCHLD, 0, 0, 0, 0}},
      {"clone, user", {SYS_clone, CLONE_NEWUSER | SIGCHLD, 0, 0, 0, 0}},
      {"fanotify_init", {SYS_fanotify_init}},
      {"finit_module", {SYS_finit_module}},
      {"fsopen", {SYS_fsopen}},
      {"init_module", {SYS_init_module}},
      {"ioctl, type into a terminal", {SYS_ioctl, 0, TIOCSTI, 0}},
      {"io_uring_enter", {SYS_io_uring_enter}},
      {"io_uring_register", {SYS_io_uring_register}},
      {"io_uring_setup", {SYS_io_uring_setup}},
      {"kcmp", {SYS_kcmp}},
      {"kexec_load", {SYS_kexec_load}},
      {"keyctl", {SYS_keyctl}},
      {"mbind", {SYS_mbind}},
      {"mount", {SYS_mount}},
      {"mount_setattr", {SYS_mount_setattr}},
      {"move_mount", {SYS_move_mount}},
      {"move_pages", {SYS_move_pages}},
      {"name_to_handle_at", {SYS_name_to_handle_at}},
      {"open_by_handle_at", {SYS_open_by_handle_at}},
      {"open_tree", {SYS_open_tree}},
      {"perf_event_open", {SYS_perf_event_open}},
      {"personality", {SYS_personality}},
      {"pidfd_getfd", {SYS_pidfd_getfd}},
      {"pivot_root", {SYS_pivot_root}},
      {"process_vm_readv", {SYS_process_vm_readv}},
      {"process_vm_writev", {SYS_process_vm_writev}},
      {"ptrace", {SYS_ptrace}},
      {"reboot", {SYS_reboot}},
      {"request_key", {SYS_request_key}},
      {"setns", {SYS_setns}},
      {"umount2", {SYS_umount2}},
      {"unshare", {SYS_unshare}},
      {"userfaultfd", {SYS_userfaultfd}},
      {"vmsplice", {SYS_vmsplice}},
      {"socket, internet", {SYS_socket, AF_INET, SOCK_STREAM, 0}},
      {"socket, netlink", {SYS_socket, AF_NETLINK, SOCK_RAW, 0}},
      {"socketpair, internet", {SYS_socketpair, AF_INET, SOCK_STREAM, 0}}};
  std::string words;
  for (const auto& [name, numbers] : calls) {
    words += " '";
    for (const char c : name) words += c == ' ' ? '_' : c;
    for (std::size_t i = 0; i < numbers.size(); ++i) words += (i == 0 ? '=' : ',') + std::to_string(numbers[i]);
    words += "'";
  }
  folder_.write("given/caller.py", kCaller);
  ASSERT_EQ(end_of("python3 \"${0%/*}/caller.py\" > made" + words), "") << last_words(run_);
  const auto inside = words_by_name(folder_.read("result"));
  const std::string nobody = ::geteuid() == 0 ? "setpriv --reuid 65534 --regid 65534 --clear-groups " : "",
                    program = (folder_.path() / "given/caller.py").string();
  ASSERT_EQ(std::system((nobody + "/usr/bin/python3 " + program + words + " < /dev/null > " +
                         (folder_.path() / "outside").string())
                            .c_str()),
            0);
  const auto outside = words_by_name(folder_.read("outside"));
  ASSERT_EQ(inside.size(), calls.size());
  ASSERT_EQ(outside.size(), calls.size());
  std::size_t told = 0;
  for (const auto& [name, became] : inside) {
    const std::string refused = name.starts_with("socket") ? "EAFNOSUPPORT" : "ENOSYS";
    EXPECT_EQ(became, refused) << name;
    told += outside.at(name) != refused;  // a kernel may be built without some
    if (outside.at(name) == refused) std::printf("%s: this kernel has none\n", name.c_str());
  }
  EXPECT_GT(told, calls.size() / 2);
}

TEST_F(SandboxTest, ComputesWithNumpyAndThreads) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2> /dev/null") != 0)
    GTEST_SKIP() << "no numpy for Python (Debian package python3-numpy)";
  folder_.write("given/compute.py", R"(import multiprocessing, socket, subprocess, tempfile, threading, numpy
a = numpy.random.default_rng(1).normal(size=(50, 50))
assert numpy.allclose(numpy.linalg.inv(a) @ a, numpy.eye(50))
done = []
thread = threading.Thread(target=lambda: done.append(numpy.linalg.norm(a)))
thread.start()
thread.join()
assert done
a_end, other = socket.socketpair()
a_end.send(b'x')
assert other.recv(1) == b'x'
with tempfile.TemporaryFile() as file: numpy.save(file, a)
assert multiprocessing.get_context('fork').Pool(2).map(abs, [-1, 2]) == [1, 2]
assert subprocess.run(['/bin/true']).returncode == 0
)");
  EXPECT_EQ(end_of("python3 \"${0%/*}/compute.py\""), "") << last_words(run_);
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
