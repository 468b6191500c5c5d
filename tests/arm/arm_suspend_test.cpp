// The arm's driver on a machine that was suspended: the old set-point is not sent again, and the fault is kept.
#include <gtest/gtest.h>

#include "tests/arm/arm_bench.hpp"
#include "tests/arm/still_arm.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/sleepy_clock.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::SleepyClock;
using testing_support::StillArm;

constexpr std::array<int, kJoints> kDriven{0, 0, 300, 0, 0};

TEST(ArmOnAMachineThatSleeps, RestsWithoutAnotherSetPointAndRefusesMotionUntilTheFaultIsCleared) {
  StillArm bench;
  const auto exchange = [&](const std::array<int, kJoints>& demand) {
    bench.pass(bench.arm->exchange_period());
    EXPECT_TRUE(drive_ticks(*bench.arm, demand).ok());
    bench.acknowledge();
    bench.answer(1234);
    EXPECT_TRUE(bench.arm->try_read().ok());
  };
  for (int i = 0; i < 6; ++i) exchange({});
  exchange(kDriven);
  ASSERT_FALSE(bench.rests());
  bench.pass(3 * bench.arm->exchange_period());  // as a machine takes to be frozen: no time-out has run off
  bench.bus->sent.clear();
  bench.clock.suspend(8h);
  const auto news = bench.arm->try_read();
  ASSERT_FALSE(news.ok());
  EXPECT_EQ(describe(news.error()), "arm: stopped, the machine was suspended: refused");
  ASSERT_FALSE(bench.bus->sent.empty());
  for (const CanFrame& frame : bench.bus->sent) EXPECT_EQ(frame.data[0], 0) << "driven on, id " << frame.id;

  EXPECT_FALSE(drive_ticks(*bench.arm, kDriven).ok());
  EXPECT_TRUE(bench.rests());
  bench.pass();
  EXPECT_FALSE(drive_ticks(*bench.arm, kDriven).ok()) << "for good";
}

/// Its cycle hangs: nobody reads.
TEST(ArmOnAMachineThatSleeps, IsStoppedByTheDriversOwnThreadTooBeforeItsWatchdog) {
  SleepyClock clock;
  const ArmModel model = arm5e();
  sim::ArmEmulatorParameters parameters;
  parameters.can_paced = true;
  parameters.watchdog = 0s;  // so that what stops it is what is looked at
  sim::ArmEmulator emulator(model, parameters, clock);
  auto [driver, device] = make_can_pair(clock);
  emulator.serve(std::move(device));
  Arm5eSettings settings;
  settings.watchdog = 10min;
  Arm5e arm(settings, model, std::make_unique<CanArmLink>(std::move(driver), settings.can_ids, settings.can.bitrate),
            clock);
  const auto moves = [&] { return emulator.true_velocity_at(clock.now()).cwiseAbs().maxCoeff() > 0; };
  const auto until = [&](const auto& condition) {
    for (const Stamp end = clock.now() + 20s; clock.now() < end; clock.sleep_until(clock.now() + 5ms))
      if (condition()) return true;
    return false;
  };
  ASSERT_TRUE(until([&] {
    (void)arm.try_read();
    (void)drive_ticks(arm, kDriven);
    return moves();
  }));
  const auto stops = [&] {
    for (const Statistic& s : arm.statistics())
      if (s.name == "watchdog_stops") return s.value;
    return -1.0;
  };
  ASSERT_EQ(stops(), 0);
  clock.suspend(1h);
  EXPECT_TRUE(until([&] { return stops() == 1 && !moves(); })) << stops() << " stops";
}

}  // namespace
}  // namespace tankrig
