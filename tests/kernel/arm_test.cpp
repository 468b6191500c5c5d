// The arm driver against the arm's emulator, with the kernel's own drivers in between.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "drivers/serial/serial_port.hpp"
#include "tests/kernel/emulated_arm.hpp"
#include "tests/kernel/guest.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kOneTick = 1e-3;  // more than one tick of any joint but the wrist, whose tick is 3.1 mrad [rad]

void expect_it_follows(EmulatedArm& arm) {
  arm.home();
  EXPECT_TRUE(arm.moves_elbow(0.1));
  EXPECT_LT(arm.error_at_rest(), kOneTick);
  EXPECT_TRUE(arm.moves_elbow(-0.1));
  EXPECT_LT(arm.error_at_rest(), kOneTick);
  EXPECT_GT(statistic(*arm.driver, "exchanges"), 20);
  EXPECT_EQ(statistic(*arm.driver, "jumps"), 0);
  EXPECT_EQ(statistic(*arm.driver, "disconnects"), 0);
}

TEST(ArmOnVcan, FollowsWhatItIsTold) {
  EmulatedArm arm("vcan0", "vcan0", 1'000'000);
  expect_it_follows(arm);
}

TEST(ArmOnTwoControllers, FollowsWhatItIsTold) {
  EmulatedArm arm("can0", "can1", 1'000'000);
  expect_it_follows(arm);
}

TEST(ArmOnAPty, FollowsWhatItIsTold) {
  const TemporaryFolder folder;
  EmulatedArm arm(folder.path() / "arm");
  expect_it_follows(arm);
}

/// Carries bytes between two serial lines until the end of the scope.
class Bridge {
 public:
  Bridge(const std::string& a, const std::string& b) : a_({a}), b_({b}), thread_([this] { run(); }) {}
  ~Bridge() {
    ends_ = true;
    thread_.join();
  }

 private:
  void run() {
    while (!ends_) {
      carry(a_, b_);
      carry(b_, a_);
      (void)a_.wait_readable(milliseconds(1));
    }
  }
  static void carry(SerialPort& from, SerialPort& to) {
    std::uint8_t bytes[64];
    const auto read = from.try_read(bytes);
    std::size_t left = read.ok() ? read.value() : 0;
    for (std::size_t at = 0; at < left;) {
      const auto written = to.try_write({bytes + at, left - at});
      if (!written.ok()) return;
      at += written.value();
    }
  }

  SerialPort a_, b_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

TEST(ArmOnTwoUarts, FollowsWhatItIsTold) {
  const TemporaryFolder folder;
  const auto pty = folder.path() / "arm";
  EmulatedArm arm(pty, "/dev/ttyS1");
  Bridge bridge(pty.string(), "/dev/ttyS2");
  expect_it_follows(arm);
  EXPECT_EQ(statistic(*arm.driver, "checksum_errors"), 0);
}

/// On rigcan0 (driver) and rigcan1 (emulator), moving.
class ArmOnFaultyCan : public testing::Test {
 protected:
  void SetUp() override { up(200); }
  void TearDown() override {
    set_link("rigcan0", "down");
    set_link("rigcan1", "down");
  }
  void up(int restart_ms) {
    for (const char* port : {"rigcan0", "rigcan1"}) {
      set_link(port, "down");
      set_link(port, "up type can bitrate 500000 restart-ms " + std::to_string(restart_ms));
    }
  }
  static void expect_it_goes_on(EmulatedArm& arm) {
    EXPECT_TRUE(arm.moves_elbow(0.03));
    EXPECT_LT(arm.error_at_rest(), kOneTick);
  }
};

TEST_F(ArmOnFaultyCan, BusOffIsSilenceUntilTheRestartAndThenItGoesOn) {
  up(3000);
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  ASSERT_TRUE(arm.moves_elbow(0.03));
  const Stamp begin = arm.clock.now();
  set_fault("rigcan0", "busoff");
  const auto error = arm.next_error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, ErrorCode::kTimeout);
  EXPECT_STREQ(error->where, "arm: silent");
  EXPECT_GE(arm.clock.now() - begin, milliseconds(900));  // the silence time-out, less an exchange's period
  expect_it_goes_on(arm);
  EXPECT_GE(arm.clock.now() - begin, milliseconds(3000));
  EXPECT_EQ(statistic(*arm.driver, "can_bus_off"), 1);
  EXPECT_EQ(statistic(*arm.driver, "can_restarted"), 1);
}

TEST_F(ArmOnFaultyCan, AShortBusOffIsBridged) {
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  ASSERT_TRUE(arm.moves_elbow(0.03));
  set_fault("rigcan0", "busoff");
  expect_it_goes_on(arm);
  EXPECT_EQ(statistic(*arm.driver, "can_bus_off"), 1);
}

TEST_F(ArmOnFaultyCan, AnArmThatIsSwitchedOffIsSilentAndComesBack) {
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  ASSERT_TRUE(arm.moves_elbow(0.03));
  set_link("rigcan1", "down");
  const auto error = arm.next_error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, ErrorCode::kTimeout);
  EXPECT_GE(statistic(*arm.driver, "can_no_ack"), 1);
  set_link("rigcan1", "up");
  expect_it_goes_on(arm);
}

TEST_F(ArmOnFaultyCan, AFullQueueIsCountedAndSilence) {
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  ASSERT_TRUE(arm.moves_elbow(0.03));
  set_fault("rigcan0", "txfull");
  const auto error = arm.next_error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, ErrorCode::kTimeout);
  EXPECT_TRUE(becomes_true([&] {
    (void)arm.driver->try_read();
    (void)arm.driver->stop();
    return statistic(*arm.driver, "send_buffer_full") > 0;
  }));
  set_fault("rigcan0", "active");
  expect_it_goes_on(arm);
}

/// Nobody acknowledges while the program drives the arm and ends; then the bus is back.
TEST_F(ArmOnFaultyCan, DemandsThatWaitMoveNothingWhenTheBusIsBackAfterTheProgramsEnd) {
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  ASSERT_TRUE(arm.moves_elbow(0.03));
  EXPECT_LT(arm.error_at_rest(), kOneTick);
  const JointVector before = arm.emulator.truth_at(arm.clock.now());
  set_fault("rigcan0", "noack");
  EXPECT_FALSE(arm.moves_elbow(0.03, seconds(2)));
  EXPECT_GE(statistic(*arm.driver, "can_no_ack"), 1);
  arm.driver.reset();
  set_fault("rigcan0", "active");
  EXPECT_TRUE(becomes_true([&] { return arm.emulator.rest_since().has_value(); }));
  arm.clock.sleep_until(arm.clock.now() + seconds(1));
  EXPECT_LT((arm.emulator.truth_at(arm.clock.now()) - before).cwiseAbs().maxCoeff(), 2 * kOneTick);
  EXPECT_EQ(arm.emulator.true_velocity_at(arm.clock.now()).cwiseAbs().maxCoeff(), 0);
}

TEST_F(ArmOnFaultyCan, WarningAndPassiveDoNotDisturb) {
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  set_fault("rigcan0", "warn");
  EXPECT_TRUE(arm.moves_elbow(0.03));
  EXPECT_EQ(statistic(*arm.driver, "can_state"), static_cast<double>(CanState::kErrorWarning));
  set_fault("rigcan0", "passive");
  EXPECT_TRUE(arm.moves_elbow(0.03));
  EXPECT_EQ(statistic(*arm.driver, "can_state"), static_cast<double>(CanState::kErrorPassive));
  EXPECT_LT(arm.error_at_rest(), kOneTick);
}

TEST_F(ArmOnFaultyCan, AnInterfaceThatGoesDownIsALostCarrierAndFoundAgain) {
  EmulatedArm arm("rigcan0", "rigcan1", 500'000);
  arm.home();
  ASSERT_TRUE(arm.moves_elbow(0.03));
  set_link("rigcan0", "down");
  const auto error = arm.next_error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, ErrorCode::kDisconnected);
  EXPECT_EQ(error->os_errno, ENETDOWN);
  set_link("rigcan0", "up");
  expect_it_goes_on(arm);
  EXPECT_EQ(statistic(*arm.driver, "disconnects"), 1);
  EXPECT_EQ(statistic(*arm.driver, "can_reopened"), 1);
}

}  // namespace
}  // namespace tankrig::test
