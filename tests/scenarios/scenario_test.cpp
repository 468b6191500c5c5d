// Every scenario of the table: a scan with its faults, and whether what must happen happens.
#include "tests/scenarios/scenario.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "tests/support/temporary_folder.hpp"

namespace tankrig::scenarios {
namespace {

namespace fs = std::filesystem;

constexpr int kForbidden = 77;

std::string played(const Scenario& scenario, const fs::path& session) {
  const Outcome outcome = scan_with_faults(scenario.plan, session, scenario.picture);
  std::printf("%s\n", summary(outcome).c_str());
  std::string text;
  for (const std::string& line : differences(scenario, outcome, session)) text += line + "\n";
  return text;
}

void write_file(const fs::path& file, const char* text) {
  if (std::FILE* out = std::fopen(file.c_str(), "w")) {
    std::fputs(text, out);
    std::fclose(out);
  }
}

/// A file system of its own at `folder`, seen by this process only. False if that is not permitted.
bool mount_small_disk(const fs::path& folder, int kib) {
  const uid_t user = ::getuid();
  if (::unshare(CLONE_NEWNS) != 0) {
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
    write_file("/proc/self/setgroups", "deny");
    write_file("/proc/self/uid_map", ("0 " + std::to_string(user) + " 1").c_str());
  }
  if (::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return false;
  const std::string size = "size=" + std::to_string(kib) + "k";
  return ::mount("tmpfs", folder.c_str(), "tmpfs", 0, size.c_str()) == 0;
}

/// In a process of its own, whose disk is small or whose files may not grow.
std::string played_in_want_of_room(const Scenario& scenario, const fs::path& folder, bool& forbidden) {
  int pipe[2];
  if (::pipe(pipe) != 0) return std::strerror(errno);
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[0]);
    if (scenario.file_kib > 0) {
      ::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{static_cast<rlim_t>(scenario.file_kib) << 10, static_cast<rlim_t>(scenario.file_kib) << 10};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    if (scenario.disk_kib > 0 && !mount_small_disk(folder, scenario.disk_kib)) ::_exit(kForbidden);
    const std::string text = played(scenario, folder / "session");
    std::fflush(stdout);
    [[maybe_unused]] const ssize_t told = ::write(pipe[1], text.data(), text.size());
    ::_exit(0);
  }
  ::close(pipe[1]);
  std::string text;
  char buffer[4096];
  for (ssize_t n = 0; (n = ::read(pipe[0], buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(n));
  ::close(pipe[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  forbidden = WIFEXITED(status) && WEXITSTATUS(status) == kForbidden;
  if (!forbidden && !(WIFEXITED(status) && WEXITSTATUS(status) == 0)) text += "the scan's process died\n";
  return text;
}

class Scenarios : public testing::TestWithParam<Scenario> {};

TEST_P(Scenarios, EndsAsExpected) {
  const Scenario& scenario = GetParam();
  const TemporaryFolder folder;
  bool forbidden = false;
  const std::string wrong = scenario.disk_kib > 0 || scenario.file_kib > 0
                                ? played_in_want_of_room(scenario, folder.path(), forbidden)
                                : played(scenario, folder.path() / "session");
  if (forbidden) GTEST_SKIP() << "this machine permits no mount of one's own: " << std::strerror(EPERM);
  EXPECT_EQ(wrong, "");
}

INSTANTIATE_TEST_SUITE_P(Faults, Scenarios, testing::ValuesIn(scenarios()),
                         [](const auto& scenario) { return scenario.param.name; });

}  // namespace
}  // namespace tankrig::scenarios
