// The guardian as a process, on emulated devices that have no watchdog, when its program ends in every way there is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <thread>

#include "drivers/serial/serial_port.hpp"
#include "rig/guardian/guardian_report.hpp"
#include "sim_backends/wire/arm_emulator.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/guardian/guarded_program.hpp"
#include "tests/support/control_group.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr Duration kLongest = 60s;

class GuardianOn : public testing::TestWithParam<std::string> {
 protected:
  GuardianOn() : hub_({.path = folder_.path() / "arm.can", .bitrate = 1'000'000}) {
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // the guardian is ours to wait for when its program has gone
    sim::ArmEmulatorParameters parameters;
    parameters.power_up << 0, 0.12, 1.3, 0, 0.1;
    parameters.watchdog = 0s;
    parameters.can_bitrate = 1'000'000;
    arm_ = std::make_unique<sim::ArmEmulator>(arm5e(), parameters, clock_);
    CanSettings can;
    can.interface = "unix:" + (folder_.path() / "arm.can").string();
    can.bitrate = parameters.can_bitrate;
    can.filters = parameters.can_ids.host_filters();
    arm_->serve(open_can(can, clock_));
    arm_->serve(folder_.path() / "arm");
    save_arm_zero(folder_.path() / "zero.yaml", {arm_->true_zero(), "emulated"});
    relay_ = std::make_unique<sim::RelayEmulator>(
        sim::RelayEmulatorSettings{.name = folder_.path() / "laser", .protocol = protocol(), .watchdog = 0s}, lamp_);
  }
  ~GuardianOn() override {
    for (const pid_t process : {program_, guardian_})
      if (process > 0 && ::waitpid(process, nullptr, WNOHANG) == 0) {
        ::kill(process, SIGKILL);
        ::waitpid(process, nullptr, 0);
      }
  }

  static RelayProtocol protocol() {
    RelayProtocol p;
    p.status_query = 3;
    return p;
  }

  template <class IsSo>
  bool until(IsSo is_so, Duration longest = kLongest) {
    for (const Stamp end = clock_.now() + longest; clock_.now() < end; clock_.sleep_until(clock_.now() + 1ms))
      if (is_so()) return true;
    return false;
  }
  double speed() { return arm_->true_velocity_at(clock_.now()).cwiseAbs().maxCoeff(); }
  bool safe() { return !relay_->relay_closed() && speed() < 1e-3; }

  /// Lit and moving.
  void start() {
    program_ = ::fork();
    if (program_ == 0) {
      ::execl("/proc/self/exe", "test_guardian", "program", folder_.path().c_str(), GetParam().c_str(), nullptr);
      ::_exit(127);
    }
    ASSERT_TRUE(until([&] { return relay_->relay_closed() && speed() > 0.05; }));
    std::ifstream(folder_.path() / "guardian.pid") >> guardian_;
    ASSERT_GT(guardian_, 0);
    clock_.sleep_until(clock_.now() + 100ms);
  }

  /// The exit code of a process that ends, or 128 and its signal; -1: it does not.
  int code_of(pid_t& process) {
    int status = 0;
    if (!until([&] { return ::waitpid(process, &status, WNOHANG) == process; })) return -1;
    process = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string report() { return folder_.read("report"); }

  /// `stopped_at` is at most one cycle later than the last completed step. Call it before anybody ends: that
  /// makes the witness late by tens of milliseconds.
  void expect_in_time(Stamp stopped_at, const testing_support::MachineWitness& witness) {
    ASSERT_TRUE(until([&] { return safe(); }));
    const auto off = relay_->off_since();
    const auto rest = arm_->rest_since();
    ASSERT_TRUE(off && rest);
    RecordProperty("off_byte_ms", std::to_string(1e3 * seconds(*off - stopped_at)));
    RecordProperty("rest_ms", std::to_string(1e3 * seconds(*rest - stopped_at)));
    if (testing_support::kSlowness > 1) return;
    TANKRIG_SKIP_IF_LATE(witness, 15ms);
    EXPECT_LT(*off - stopped_at, 95ms);
    EXPECT_LT(*rest - stopped_at, 145ms);
  }

  TemporaryFolder folder_;
  MonotonicClock clock_;
  sim::MockLaser lamp_{20ms, clock_};
  sim::CanHub hub_;
  std::unique_ptr<sim::ArmEmulator> arm_;
  std::unique_ptr<sim::RelayEmulator> relay_;
  pid_t program_ = -1, guardian_ = -1;
};

INSTANTIATE_TEST_SUITE_P(Carriers, GuardianOn, testing::Values("can", "serial"),
                         [](const auto& carrier) { return carrier.param; });

TEST_P(GuardianOn, EndsWithAProgramThatEndsInOrder) {
  start();
  ::kill(program_, SIGTERM);
  EXPECT_EQ(code_of(program_), 0);
  EXPECT_TRUE(safe());
  EXPECT_EQ(report(), "");
}

TEST_P(GuardianOn, HasLeftItsLinesWhenItsReportIsUnlocked) {
  start();
  ::kill(program_, SIGKILL);
  const std::filesystem::path left = folder_.path() / "report";
  ASSERT_TRUE(until([&] { return guardian_at_work(left).has_value(); }));
  while (guardian_at_work(left)) std::this_thread::yield();
  EXPECT_NO_THROW(SerialPort(testing_support::guarded_devices(folder_.path(), GetParam()).laser_line));
}

TEST_P(GuardianOn, MakesSafeWhenItsProgramIsKilled) {
  const testing_support::MachineWitness witness;
  start();
  const Stamp killed = clock_.now();
  ::kill(program_, SIGKILL);
  expect_in_time(killed, witness);
  EXPECT_EQ(code_of(program_), 128 + SIGKILL);
  EXPECT_EQ(code_of(guardian_), 3) << "both confirmed";
  EXPECT_THAT(report(), AllOf(HasSubstr("which had ended: laser off, arm at rest"), HasSubstr("confirmed after")));
  EXPECT_THAT(take_guardian_report(folder_.path() / "report", "rig"), HasSubstr("took over"));
  EXPECT_EQ(take_guardian_report(folder_.path() / "report", "rig"), "") << "shown once";
}

/// As a debugger does. When it wakes up it finds itself taken over, lights and moves nothing, and ends.
TEST_P(GuardianOn, MakesSafeWhenItsProgramIsStoppedAndKeepsItFromGoingOn) {
  const testing_support::MachineWitness witness;
  start();
  const Stamp stopped = clock_.now();
  ::kill(program_, SIGSTOP);
  expect_in_time(stopped, witness);
  ASSERT_TRUE(until([&] { return guardian_at_work(folder_.path() / "report").has_value(); }));
  EXPECT_THROW(take_guardian_report(folder_.path() / "report", "rig"), std::exception) << "the next command is refused";
  (void)relay_->take_received();
  const auto rested = arm_->rest_since();
  ::kill(program_, SIGCONT);
  EXPECT_EQ(code_of(program_), testing_support::kObjected);
  EXPECT_EQ(code_of(guardian_), 3);
  EXPECT_THAT(relay_->take_received(), ::testing::Not(::testing::Contains(protocol().on_byte)));
  EXPECT_EQ(arm_->rest_since(), rested) << "nothing moved again";
  EXPECT_THAT(report(), HasSubstr("which stood still: laser off, arm at rest"));
}

TEST_P(GuardianOn, MakesSafeWhenItsProgramIsFrozen) {
  const testing_support::MachineWitness witness;
  start();
  testing_support::ControlGroup group(program_);
  if (!group.reachable()) GTEST_SKIP() << "no control groups of version 2 that this user may make and freeze";
  const Stamp frozen = clock_.now();
  ASSERT_TRUE(group.freeze(true));
  ASSERT_TRUE(until([&] { return safe(); }));
  expect_in_time(frozen, witness);
  ASSERT_TRUE(group.freeze(false));
  EXPECT_EQ(code_of(program_), testing_support::kObjected);
  EXPECT_EQ(code_of(guardian_), 3);
}

TEST_P(GuardianOn, IsMissedWhenItIsKilledOrStopped) {
  for (const int signal : {SIGKILL, SIGSTOP}) {
    start();
    ::kill(guardian_, signal);
    EXPECT_EQ(code_of(program_), testing_support::kObjected);
    EXPECT_TRUE(until([&] { return safe(); }));
    ::kill(guardian_, SIGKILL);
    EXPECT_EQ(code_of(guardian_), 128 + SIGKILL);
  }
}

TEST_P(GuardianOn, GoesOnAskingUntilPulledLinesAreBack) {
  start();
  relay_->unplug();
  arm_->unplug();
  ::kill(program_, SIGKILL);
  EXPECT_EQ(code_of(program_), 128 + SIGKILL);
  EXPECT_FALSE(until([&] { return ::waitpid(guardian_, nullptr, WNOHANG) != 0; }, 2s)) << "it does not give up";
  EXPECT_TRUE(relay_->relay_closed());
  relay_->plug();
  arm_->plug();
  EXPECT_EQ(code_of(guardian_), 3);
  EXPECT_TRUE(safe());
}

TEST_P(GuardianOn, EndsUnconfirmedWhenAnOperatorSaysThatThePowerIsCut) {
  start();
  relay_->unplug();
  ::kill(program_, SIGKILL);
  EXPECT_EQ(code_of(program_), 128 + SIGKILL);
  std::optional<int> process;
  ASSERT_TRUE(until([&] { return (process = guardian_at_work(folder_.path() / "report")).has_value(); }));
  EXPECT_EQ(*process, guardian_);
  ::kill(guardian_, SIGTERM);
  EXPECT_FALSE(until([&] { return ::waitpid(guardian_, nullptr, WNOHANG) != 0; }, 500ms)) << "no signal ends it";
  ::kill(guardian_, SIGUSR1);
  EXPECT_EQ(code_of(guardian_), 1);
  EXPECT_THAT(report(), AllOf(HasSubstr("laser off not confirmed"), HasSubstr("the power was cut")));
}

int run_guardian_of(char** argv) {
  const GuardianSettings settings = testing_support::guarded_devices(argv[2], argv[3]);
  return run_guardian(settings, OwnedDescriptor(std::atoi(argv[5])), OwnedDescriptor(std::atoi(argv[7])));
}

}  // namespace
}  // namespace tankrig

int main(int argc, char** argv) {
  if (argc == 8 && std::strcmp(argv[1], "guardian") == 0) return tankrig::run_guardian_of(argv);
  if (argc == 4 && std::strcmp(argv[1], "program") == 0)
    return tankrig::testing_support::run_guarded_program(argv[2], argv[3]);
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
