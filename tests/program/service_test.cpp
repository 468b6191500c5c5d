// What systemd is told by a command that moves the arm, and what its unit says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <regex>
#include <thread>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

namespace tankrig::test {
namespace {

/// The service manager's end of NOTIFY_SOCKET; the program inherits it.
class NotifySocket {
 public:
  /// `watchdog_us`, `watchdog_pid`: empty: not said.
  explicit NotifySocket(const std::string& watchdog_us = "", const std::string& watchdog_pid = "") {
    if (!watchdog_us.empty()) environment_["WATCHDOG_USEC"] = watchdog_us;
    if (!watchdog_pid.empty()) environment_["WATCHDOG_PID"] = watchdog_pid;
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const fs::path name = fs::path(testing::TempDir()) / ("notify-" + std::to_string(::getpid()));
    name.native().copy(address.sun_path, sizeof address.sun_path - 1);
    ::unlink(name.c_str());
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      ADD_FAILURE() << name << ": " << std::strerror(errno);
    environment_["NOTIFY_SOCKET"] = name;
    for (const auto& [key, value] : environment_) ::setenv(key.c_str(), value.c_str(), 1);
    thread_ = std::thread([this] { listen(); });
  }
  ~NotifySocket() {
    if (thread_.joinable()) (void)told();
    for (const auto& [key, value] : environment_) ::unsetenv(key.c_str());
    ::unlink(environment_["NOTIFY_SOCKET"].c_str());
    ::close(socket_);
  }

  /// Everything, in order. Call once, after the program has ended.
  std::vector<std::string> told() {
    ends_ = true;
    thread_.join();
    return told_;
  }

 private:
  void listen() {
    for (;;) {
      const bool last = ends_;  // what was sent before is there by now
      pollfd door{socket_, POLLIN, 0};
      std::array<char, 512> text;
      while (::poll(&door, 1, last ? 0 : 10) == 1) {
        const ssize_t size = ::recv(socket_, text.data(), text.size(), 0);
        if (size > 0) told_.emplace_back(text.data(), static_cast<std::size_t>(size));
      }
      if (last) return;
    }
  }

  std::map<std::string, std::string> environment_;
  int socket_ = -1;
  std::atomic<bool> ends_{false};
  std::vector<std::string> told_;
  std::thread thread_;
};

ProgramRun jog() { return run_tankrig({"arm", "jog", "elbow", "-5", "--relative", "--json"}); }

TEST(AService, SaysThatItIsReadyAndLivesUntilTheArmRests) {
  constexpr double kWatchdog_s = 1.5;  // so that all it says fits the socket's queue, ten long, at virtual speed
  NotifySocket systemd("1500000");
  const ProgramRun run = jog();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto told = systemd.told();
  ASSERT_GE(told.size(), 3u);
  EXPECT_EQ(told.front(), "READY=1\nWATCHDOG=1\nWATCHDOG_USEC=1500000");
  EXPECT_EQ(told.back(), "WATCHDOG_USEC=0") << "pictures and the report take their time, and move nothing";
  const auto lives = std::count(told.begin(), told.end(), "WATCHDOG=1");
  const double motion_s = run.json().at("duration_s").get<double>();
  EXPECT_EQ(lives, static_cast<int>(told.size()) - 2);
  EXPECT_NEAR(lives, 3 * motion_s / kWatchdog_s, 1) << "three times in the watchdog's time, however often it looks";
}

TEST(AService, ThatIsNotWatchedSaysOnlyThatItIsReady) {
  for (const auto& [watchdog, process] : {std::pair{"", ""}, std::pair{"600000", "1"}}) {
    NotifySocket systemd(watchdog, process);
    ASSERT_EQ(jog().exit_code, 0);
    EXPECT_THAT(systemd.told(), ElementsAre("READY=1"));
  }
}

TEST(AService, ThatIsRefusedNeverSaysThatItIsReady) {
  NotifySocket systemd("600000");
  EXPECT_EQ(run_tankrig({"arm", "jog", "elbow", "400"}).exit_code, 1);
  EXPECT_THAT(systemd.told(), IsEmpty());
}

/// The lines "KEY=VALUE" of the unit.
std::multimap<std::string, std::string> unit() {
  const std::string text = read_text(fs::path(TANKRIG_SOURCE_DIR) / "etc/systemd/tankrig@.service");
  std::multimap<std::string, std::string> keys;
  static const std::regex line("(^|\n)([A-Za-z]+)=([^\n]*)");
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it) keys.emplace((*it)[2], (*it)[3]);
  return keys;
}
std::string value(const char* key) {
  const auto keys = unit();
  EXPECT_EQ(keys.count(key), 1u) << key;
  const auto found = keys.find(key);
  return found == keys.end() ? "" : found->second;
}

TEST(TheUnit, IsWatchedMadeSafeHoweverItEndsAndTheLastToBeKilled) {
  EXPECT_EQ(value("Type"), "notify");
  EXPECT_EQ(value("NotifyAccess"), "main") << "the guardian inherits the socket";
  EXPECT_GT(std::atoi(value("WatchdogSec").c_str()), 0);
  EXPECT_THAT(value("ExecStopPost"), HasSubstr("arm stop --rig %i"));
  EXPECT_LE(std::atoi(value("OOMScoreAdjust").c_str()), -900);
  EXPECT_EQ(value("KillSignal"), "SIGINT");
  EXPECT_EQ(value("SendSIGKILL"), "no") << "the guardian goes on until all is safe";
  EXPECT_EQ(value("Restart"), "no");
}

TEST(TheUnit, NeverMovesAtBootAndAsksNobodyWhoIsNotThere) {
  EXPECT_THAT(read_text(fs::path(TANKRIG_SOURCE_DIR) / "etc/systemd/tankrig@.service"), Not(HasSubstr("[Install]")));
  EXPECT_THAT(value("ExecStart"), HasSubstr("--yes"));
  EXPECT_THAT(value("ExecStart"), Not(HasSubstr("--waive"))) << "whoever starts it has made the start-up test";
}

TEST(TheUnit, IsReadBySystemdWithoutAWord) {
  if (std::system("command -v systemd-analyze >/dev/null") != 0) GTEST_SKIP() << "there is no systemd-analyze";
  const fs::path folder = scratch_folder();
  for (const char* file : {"tankrig@.service", "tankrig-can@.service"}) {
    std::string text = read_text(fs::path(TANKRIG_SOURCE_DIR) / "etc/systemd" / file);
    text = std::regex_replace(text, std::regex("=(-?)tankrig "), "=$1" TANKRIG_PROGRAM " ");
    text = std::regex_replace(text, std::regex("=(-?)ip "), "=$1/bin/true ");
    std::string name = file;
    const fs::path instance = folder / name.insert(name.find('@') + 1, "x");
    write_text(instance, text);
    const fs::path said = folder / "said.txt";
    EXPECT_EQ(
        std::system(("systemd-analyze verify --man=no " + instance.string() + " >" + said.string() + " 2>&1").c_str()),
        0);
    EXPECT_EQ(read_text(said), "") << file;
  }
}

}  // namespace
}  // namespace tankrig::test
