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
#include <system_error>
#include <thread>

#include "core/clock.hpp"
#include "rig/safety/emergency.hpp"
#include "rig/safety/guarded_outputs.hpp"
#include "rig/safety/stop_key.hpp"
#include "tests/support/few_threads.hpp"
#include "tests/support/named_thread.hpp"
#include "tests/support/sanitizers.hpp"

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

/// Without a thread there is no key, and nothing is left changed.
int leave_all_as_it_was() {
  std::atomic<bool> stop{false};
  if (!testing_support::allow_threads(0)) return kWrong;
  try {
    const StopKey sut(STDIN_FILENO, stop);
    return kWrong;
  } catch (const std::system_error&) {
  }
  sigset_t blocked;
  ::pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
  return by_key(STDIN_FILENO) || ::sigismember(&blocked, SIGINT) != 0 ? kWrong : kWell;
}

TEST(StopKey, ThatGetsNoThreadLeavesTerminalAndSignalsAsTheyWere) {
  TANKRIG_SKIP_SANITIZED("it has memory of its own, so a limit of this one stops it elsewhere");
  const int status = on_a_terminal(leave_all_as_it_was, [](int) {});
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == kWell) << status;
}

constexpr Duration kHeld = 2s;

/// Until the key is let go; no sooner.
int move_while_a_key_is_held() {
  std::atomic<bool> stop{false};
  const StopKey sut(STDIN_FILENO, stop, HeldKey{1s, 1s});
  if (!sut.active() || sut.held()) return kWrong;
  if (::write(STDOUT_FILENO, "!", 1) != 1) return kWrong;
  const Stamp begin = MonotonicClock{}.now();
  if (!wait_for(stop) || !sut.held()) return kWrong;
  return MonotonicClock{}.now() - begin >= kHeld ? kWell : kWrong;
}

TEST(StopKey, HeldToRunStopsOnceItIsLetGoAndNoSooner) {
  const int status = on_a_terminal(move_while_a_key_is_held, [](int terminal) {
    press(terminal, " ");
    MonotonicClock clock;
    for (const Stamp end = clock.now() + kHeld; clock.now() < end;) {
      EXPECT_EQ(::write(terminal, " ", 1), 1);
      clock.sleep_until(clock.now() + 40ms);
    }
  });
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == kWell) << status;
}

/// The key is held for good.
int stop_by_q_though_held() {
  std::atomic<bool> stop{false};
  const StopKey sut(STDIN_FILENO, stop, HeldKey{1h, 1h});
  if (!sut.active() || ::write(STDOUT_FILENO, "!", 1) != 1) return kWrong;
  return wait_for(stop) ? kWell : kWrong;
}

TEST(StopKey, HeldToRunStopsAtQ) {
  const int status = on_a_terminal(stop_by_q_though_held, [](int terminal) {
    press(terminal, " ");
    EXPECT_EQ(::write(terminal, "q", 1), 1);
  });
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == kWell) << status;
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
  Result<JointVector> write_velocity(const OutputRight&, const JointVector& v) noexcept override { return v; }
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
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP})
    EXPECT_EXIT(die_of(signal), ::testing::KilledBySignal(signal), "dark rest dark rest ");
}

void end_by(int signal) {
  LoudLaser laser;
  LoudArm arm;
  const EmergencyStop sut(laser, arm);
  std::signal(signal, end_safely);
  std::raise(signal);
}

TEST(EmergencyStop, MakesSafeBeforeAStopSignalThatMustEndTheProgramNow) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGALRM, SIGRTMIN})
    EXPECT_EXIT(end_by(signal), ::testing::KilledBySignal(signal), "dark rest dark rest ");
  EXPECT_EXIT(end_by(SIGTSTP), ::testing::KilledBySignal(SIGTERM), "dark rest dark rest ");
}

/// In the last resort a cycle runs that was lit and moving before.
class CycleInDeath final : public Arm {
 public:
  explicit CycleInDeath(Laser& laser) : laser_(laser) {}
  Result<std::optional<JointState>> try_read() noexcept override { return std::optional<JointState>{}; }
  Result<JointVector> write_velocity(const OutputRight&, const JointVector& v) noexcept override { return v; }
  Status stop() noexcept override { return {}; }
  Duration exchange_period() const noexcept override { return 5ms; }
  void last_resort() noexcept override { turn(); }

  void turn() noexcept {
    in_.now = in_.now + 1s;
    const InterlockOutputs& allowed = outputs_.step(in_);
    in_.arm = in_.laser_request = true;
    [[maybe_unused]] ssize_t n = allowed.laser ? ::write(2, "light ", 6) : ::write(2, "none ", 5);
    n = allowed.motion ? ::write(2, "motion ", 7) : ::write(2, "held ", 5);
  }

 private:
  Laser& laser_;
  InterlockInputs in_{.now = {1}, .interlock_closed = true, .heartbeat_fresh = true, .sweeping = true};
  GuardedOutputs outputs_{*this, laser_, SafetySettings{}};
};

void die_while_lit_and_moving() {
  LoudLaser laser;
  CycleInDeath cycle(laser);
  const EmergencyStop sut(laser, cycle);
  for (int i = 0; i < 4; ++i) cycle.turn();
  std::raise(SIGSEGV);
}

TEST(EmergencyStop, AllowsNoCycleThatStillRunsLightOrMotion) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(die_while_lit_and_moving(), ::testing::KilledBySignal(SIGSEGV),
              "light motion dark none held dark none held ");
}

TEST(EmergencyStop, DiesInBoundedTimeWhereADeviceHangs) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(die_of(SIGSEGV, true), ::testing::KilledBySignal(SIGALRM), "dark ");
}

void hang_with_every_signal_blocked() {
  sigset_t all;
  ::sigfillset(&all);
  ::sigdelset(&all, SIGSEGV);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
  die_of(SIGSEGV, true);
}

TEST(EmergencyStop, DiesInBoundedTimeWhateverSignalsAreBlocked) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(hang_with_every_signal_blocked(), ::testing::KilledBySignal(SIGALRM), "dark ");
}

int die_in_the_stop_keys_thread() {
  ::alarm(20);
  LoudLaser laser;
  LoudArm arm;
  const EmergencyStop sut(laser, arm);
  std::atomic<bool> stop{false};
  const StopKey key(STDIN_FILENO, stop);
  for (int i = 0; i < 2000; ++i) {  // it may only just begin; then this process dies of the signal
    if (testing_support::signal_thread(::getpid(), "stop-key", SIGSEGV)) ::pause();
    std::this_thread::sleep_for(10ms);
  }
  return kWrong;
}

TEST(EmergencyStop, MakesSafeAlsoWhenTheStopKeysOwnThreadCrashes) {
  std::string words;
  const int status = on_a_terminal(die_in_the_stop_keys_thread, [&](int terminal) {
    char byte = 0;
    while (::read(terminal, &byte, 1) == 1) words += byte;
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV) << status;
  EXPECT_TRUE(words.starts_with("dark rest dark rest ")) << words;
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
