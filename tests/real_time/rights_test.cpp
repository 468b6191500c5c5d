// What the cycle asks of the system: refused with words, and granted by the files in etc/ that the words name.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <regex>
#include <sstream>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "core/locked_memory.hpp"
#include "rig/platform/real_time.hpp"

namespace tankrig {
namespace {

constexpr uid_t kNobody = 65534;
constexpr char kNotSet[] = "the limits cannot be set";

/// What `ask` answers in a process without privileges, with these limits.
std::string as_a_user(rlim_t priority, rlim_t memory, const std::function<std::string()>& ask) {
  int ends[2];
  if (::pipe(ends) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit fifo{priority, priority}, lock{memory, memory};
    std::string answer = kNotSet;
    if (::setrlimit(RLIMIT_RTPRIO, &fifo) == 0 && ::setrlimit(RLIMIT_MEMLOCK, &lock) == 0 &&
        (::getuid() != 0 || ::setresuid(kNobody, kNobody, kNobody) == 0))
      answer = ask();
    (void)!::write(ends[1], answer.data(), answer.size());
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string answer;
  char part[512];
  for (ssize_t n; (n = ::read(ends[0], part, sizeof part)) > 0;) answer.append(part, static_cast<std::size_t>(n));
  ::close(ends[0]);
  ::waitpid(child, nullptr, 0);
  return answer;
}

std::string source_file(const std::string& name) {
  std::ifstream in(std::string(TANKRIG_SOURCE_DIR) + "/" + name);
  EXPECT_TRUE(in) << name;
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The first group of `pattern` in a file of etc/.
std::string found(const std::string& file, const std::string& pattern) {
  const std::string text = source_file(file);
  std::smatch match;
  EXPECT_TRUE(std::regex_search(text, match, std::regex(pattern))) << file << ": " << pattern;
  return match.empty() ? "" : match[1].str();
}

rlim_t memory_limit(const std::string& word) {
  return word == "unlimited" || word == "infinity" ? RLIM_INFINITY : static_cast<rlim_t>(std::stoul(word));
}

TEST(RealTimeRights, AUserWithoutThemIsToldWhatIsMissingAndHowToGetIt) {
  const std::string told = as_a_user(0, 65536, [] { return missing_real_time({}); });
  EXPECT_EQ(told,
            "not granted: SCHED_FIFO at priority 80, locked memory without limit: put etc/limits.d/tankrig.conf into "
            "/etc/security/limits.d and log in again, or use setcap (docs/reference/real_time.md)");
}

TEST(RealTimeRights, AScanThatRequiresThemIsRefusedInOneLine) {
  const auto refusal = [](bool required) {
    return as_a_user(0, 65536, [required] {
      RealTimeSettings settings;
      settings.required = required;
      try {
        return "warned: " + check_real_time(settings);
      } catch (const InputError& e) {
        return std::string(e.what());
      }
    });
  };
  const std::string refused = refusal(true), warned = refusal(false);
  EXPECT_TRUE(refused.starts_with("scan: real time not granted: SCHED_FIFO")) << refused;
  EXPECT_NE(refused.find("scan.real_time.required: false"), std::string::npos) << refused;
  EXPECT_EQ(refused.find('\n'), std::string::npos);
  EXPECT_TRUE(warned.starts_with("warned: not granted: SCHED_FIFO")) << warned;
}

TEST(RealTimeRights, AProcessorThatIsNotThereIsNamed) {
  RealTimeSettings settings;
  settings.cpu = 1023;
  const std::string told = missing_real_time(settings);
  EXPECT_NE(told.find("processor 1023"), std::string::npos) << told;
  EXPECT_NE(told.find("correct scan.real_time.cpu"), std::string::npos) << told;
}

struct Limits {
  rlim_t priority = 0, memory = 0;
};

Limits of_the_limits_file() {
  const std::string file = "etc/limits.d/tankrig.conf";
  return {static_cast<rlim_t>(std::stoul(found(file, R"(@tankrig\s+-\s+rtprio\s+(\d+))"))),
          memory_limit(found(file, R"(@tankrig\s+-\s+memlock\s+(\w+))"))};
}

Limits of_the_service_file() {
  const std::string file = "etc/systemd/tankrig@.service";
  return {static_cast<rlim_t>(std::stoul(found(file, R"(\nLimitRTPRIO=(\d+))"))),
          memory_limit(found(file, R"(\nLimitMEMLOCK=(\w+))"))};
}

TEST(RealTimeRights, OfTheFilesInEtcAreWhatTheCycleAsksFor) {
  for (const Limits& limits : {of_the_limits_file(), of_the_service_file()}) {
    EXPECT_GE(limits.priority, static_cast<rlim_t>(RealTimeSettings{}.priority));
    EXPECT_EQ(limits.memory, RLIM_INFINITY);
  }
}

TEST(RealTimeRights, OfTheFilesInEtcSufficeForAnOrdinaryUser) {
  for (const Limits& limits : {of_the_limits_file(), of_the_service_file()}) {
    const std::string missing = as_a_user(limits.priority, limits.memory, [] { return missing_real_time({}); });
    if (missing == kNotSet) GTEST_SKIP() << "raising limits needs CAP_SYS_RESOURCE";
    EXPECT_EQ(missing, "");
    EXPECT_EQ(as_a_user(limits.priority, limits.memory,
                        [] { return std::string(LockedMemory().locked() ? "locked" : "not"); }),
              "locked");
  }
}

TEST(RealTimeRights, AreTheCapabilitiesThatTheGuideNames) {
  EXPECT_NE(source_file("docs/reference/real_time.md").find("setcap cap_sys_nice,cap_ipc_lock+ep"), std::string::npos);
}

TEST(LockedMemory, OfAUserWithALimitIsNotBegun) {
  EXPECT_EQ(as_a_user(0, 1 << 20, [] { return std::string(LockedMemory().locked() ? "locked" : "left alone"); }),
            "left alone");
}

}  // namespace
}  // namespace tankrig
