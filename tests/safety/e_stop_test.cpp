// The stop key on a terminal, and the last resort of a dying program.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <csignal>
#include <exception>
#include <functional>
#include <thread>

#include "rig/safety/emergency.hpp"
#include "rig/safety/stop_key.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr int kWell = 0, kWrong = 1;

/// Runs `inside` in a child whose controlling terminal is a pseudo terminal; `outside` has its other end.
int on_a_terminal(int (*inside)(), const std::function<void(int terminal)>& outside) {
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) ::_exit(inside());
  outside(terminal);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (terminal >= 0) ::close(terminal);
  return status;
}

bool wait_for(const std::atomic<bool>& flag) {
  for (int i = 0; i < 2000 && !flag; ++i) std::this_thread::sleep_for(10ms);
  return flag;
}

bool by_key(int terminal) {
  termios mode{};
  return ::tcgetattr(terminal, &mode) == 0 && (mode.c_lflag & (ICANON | ECHO)) == 0;
}

/// Tells that it listens, waits for the flag, and checks that the terminal's mode was changed and comes back.
int wait_for_stop() {
  std::atomic<bool> stop{false};
  {
    const StopKey sut(STDIN_FILENO, stop);
    if (!sut.active() || !by_key(STDIN_FILENO)) return kWrong;
    if (::write(STDOUT_FILENO, "!", 1) != 1) return kWrong;
    if (!wait_for(stop)) return kWrong;
  }
  return by_key(STDIN_FILENO) ? kWrong : kWell;
}

void press(int terminal, const char* key) {
  char ready = 0;
  while (ready != '!' && ::read(terminal, &ready, 1) == 1) {
  }
  EXPECT_EQ(::write(terminal, key, 1), 1);
}

TEST(StopKey, StopsOnEveryOneOfItsKeysAndGivesTheTerminalItsModeBack) {
  for (const char* key : {" ", "\r", "q", "Q", "\x1b", "\x04"}) {
    const int status = on_a_terminal(wait_for_stop, [&](int terminal) { press(terminal, key); });
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == kWell) << int{*key} << ", status " << status;
  }
}

int stop_when_the_terminal_goes() {
  ::signal(SIGHUP, SIG_IGN);
  std::atomic<bool> stop{false};
  const StopKey sut(STDIN_FILENO, stop);
  if (!sut.active() || ::write(STDOUT_FILENO, "!", 1) != 1) return kWrong;
  return wait_for(stop) ? kWell : kWrong;
}

TEST(StopKey, StopsWhenItsTerminalGoesAway) {
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) ::_exit(stop_when_the_terminal_goes());
  char ready = 0;
  ASSERT_EQ(::read(terminal, &ready, 1), 1);
  ::close(terminal);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == kWell) << status;
}

TEST(StopKey, DoesNothingWhereStandardInputIsNoTerminal) {
  const int null = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  std::atomic<bool> stop{false};
  {
    const StopKey sut(null, stop);
    EXPECT_FALSE(sut.active());
  }
  EXPECT_FALSE(stop);
  ::close(null);
}

/// Devices that write what they are told to standard error, as a dying program's last words.
class LoudLaser final : public Laser {
 public:
  Status set(bool on) noexcept override {
    [[maybe_unused]] const ssize_t n = on ? ::write(2, "ON ", 3) : ::write(2, "dark ", 5);
    return {};
  }
  Result<LaserState> state() noexcept override { return LaserState{}; }
  Duration warm_up() const noexcept override { return {}; }
};
class LoudArm final : public Arm {
 public:
  Result<std::optional<JointState>> try_read() noexcept override { return std::optional<JointState>{}; }
  Result<JointVector> write_velocity(const JointVector& v) noexcept override { return v; }
  Status stop() noexcept override {
    if (hangs)
      while (true) ::pause();
    [[maybe_unused]] const ssize_t n = ::write(2, "rest ", 5);
    return {};
  }
  Duration exchange_period() const noexcept override { return 5ms; }
  bool hangs = false;
};

void die_in_a_thread_by_an_exception() {
  LoudLaser laser;
  LoudArm arm;
  const EmergencyStop sut(laser, arm);
  std::thread([] { throw 1; }).join();
}
void die_of(int signal, bool arm_hangs = false) {
  LoudLaser laser;
  LoudArm arm;
  arm.hangs = arm_hangs;
  const EmergencyStop sut(laser, arm);
  std::raise(signal);
}

TEST(EmergencyStop, SwitchesOffThenStopsBeforeTheProgramDies) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(die_in_a_thread_by_an_exception(), ::testing::KilledBySignal(SIGABRT), "dark rest dark rest ");
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
    EXPECT_EXIT(die_of(signal), ::testing::KilledBySignal(signal), "dark rest dark rest ");
}

TEST(EmergencyStop, DiesInBoundedTimeWhereADeviceHangs) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(die_of(SIGSEGV, true), ::testing::KilledBySignal(SIGALRM), "dark ");
}

TEST(EmergencyStop, LeavesNothingBehind) {
  LoudLaser laser;
  LoudArm arm;
  const auto before = std::get_terminate();
  { const EmergencyStop sut(laser, arm); }
  EXPECT_EQ(std::get_terminate(), before);
  struct sigaction action {};
  ::sigaction(SIGSEGV, nullptr, &action);
  EXPECT_EQ(action.sa_handler, SIG_DFL);
  EXPECT_FALSE(emergency_declared());
}

}  // namespace
}  // namespace tankrig
