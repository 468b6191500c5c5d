// Homing of an emulated arm under the safety step: what it finds, and everything that ends it.
#include "rig/executive/homing.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <utility>

#include "core/input_error.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/fakes.hpp"

namespace tankrig::sim {
namespace {

using tankrig::testing_support::CallLog;
using tankrig::testing_support::FakeLaser;
using testing_support::ArmBench;
using testing_support::elbow;
using testing_support::Wire;
using namespace std::chrono_literals;

struct HomingBench : ArmBench {
  CallLog log;
  FakeLaser laser{log};
  ScanSettings scan;
  std::atomic<bool> stop{false}, lid_closed{true};

  explicit HomingBench(Wire wire = Wire::kPair) : ArmBench(wire) {
    scan.control.heartbeat_timeout = 2;  // the machine may be busy
  }
  /// Near its stops: homing is short.
  void power_up_near_the_stops() {
    parameters.power_up << -1.45, 0.05, 2.05, 0.3, 0.1;
    settings.homing.rest_angle[kJawRotate] = 0.3;
    settings.homing.rest_angle[kJawOpening] = 0.1;
  }
  HomingResult home(const HomingCallback& progress = {}) {
    return home_axes({*arm, laser, clock, scan, stop, [this] { return lid_closed.load(); }, progress});
  }
  bool comes_to_rest() {
    return until([&] {
      (void)arm->try_read();
      return emulator->true_velocity_at(clock.now()).isZero(0);
    });
  }
};

class HomingOn : public ::testing::TestWithParam<Wire> {};
INSTANTIATE_TEST_SUITE_P(Each, HomingOn, ::testing::ValuesIn(testing_support::kWires), testing_support::wire_name);

TEST_P(HomingOn, FindsItsZerosByHoming) {
  HomingBench bench(GetParam());
  bench.power_up_near_the_stops();
  bench.make(false);
  EXPECT_FALSE(bench.arm->homed());
  bench.state();
  const auto refused = drive(*bench.arm, elbow(0.1));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kNotReady);
  EXPECT_STREQ(refused.error().where, "arm: not homed");
  const HomingResult homed = bench.home();
  ASSERT_TRUE(homed.ok()) << homed.message();
  const auto truth = bench.emulator->true_zero();
  for (std::size_t j = 0; j < kJoints; ++j)
    EXPECT_LE(std::abs(static_cast<std::int16_t>(homed.axes[j]->raw_at_zero - truth[j])), 2) << kJointNames[j];
  const JointState state = bench.state();
  EXPECT_NEAR(state.q[kElbow], bench.model.limits[kElbow].upper, 1e-3);
}

/// Far from zero the track rejects false zeros, near zero homing must not take a single one for the truth.
void home_while_encoders_read_zero_now_and_then(Wire wire, unsigned seed) {
  HomingBench bench(wire);
  bench.parameters.seed = seed;
  bench.power_up_near_the_stops();
  bench.parameters.power_up_ticks = {20'000, 20'000, 20'000, 20'000, 300};
  bench.parameters.zero_peak_probability = 0.1;
  bench.settings.encoder.persists_samples = 8;  // that so many in a row are all false does not happen
  bench.settings.homing.pause = 0ms;
  bench.make(false);
  bench.state();
  const auto truth = bench.emulator->true_zero();
  for (int time = 0; time < 2; ++time) {
    const HomingResult homed = bench.home();
    ASSERT_TRUE(homed.ok()) << homed.message() << ", seed " << bench.parameters.seed;
    for (std::size_t j = 0; j < kJoints; ++j)
      EXPECT_LE(std::abs(static_cast<std::int16_t>(homed.axes[j]->raw_at_zero - truth[j])), 2)
          << kJointNames[j] << ", time " << time << ", seed " << bench.parameters.seed;
  }
}

TEST_P(HomingOn, FindsItsZerosThoughEncodersReadZeroNowAndThen) {
  home_while_encoders_read_zero_now_and_then(GetParam(), 5);
}

TEST_P(HomingOn, FindsItsZerosThoughEncodersReadZeroAtOtherTimes) {
  home_while_encoders_read_zero_now_and_then(GetParam(), 6);
}

TEST(Homing, SaysWhichAxisFoundNoStopAndLeavesTheArmAtRest) {
  HomingBench bench;
  bench.settings.homing.longest = 300ms;  // the slew starts far from its stop
  bench.make(false);
  const HomingResult homed = bench.home();
  ASSERT_FALSE(homed.ok());
  EXPECT_EQ(homed.message(), "slew: arm: no stop found in its time");
  EXPECT_EQ(homed.error->code, ErrorCode::kTimeout);
  EXPECT_FALSE(bench.arm->homed());
  EXPECT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    return bench.emulator->true_velocity_at(bench.clock.now())[kSlew] == 0;
  }));
}

TEST(Homing, ReplacesAZeroOfAnotherDay) {
  HomingBench bench;
  bench.parameters.power_up << -1.45, 0.05, 2.05, 0, 0;
  bench.make();
  ArmZero wrong{bench.emulator->true_zero(), "of another day"};
  wrong.raw[kElbow] = static_cast<std::uint16_t>(wrong.raw[kElbow] + 12'000);
  bench.arm->set_zero(wrong);
  EXPECT_STREQ(bench.error().where, "arm: a joint outside its limits, home again");
  const HomingResult homed = bench.home();
  ASSERT_TRUE(homed.ok()) << homed.message();
  EXPECT_NEAR(bench.state().q[kElbow], bench.model.limits[kElbow].upper, 1e-3);
  EXPECT_TRUE(drive(*bench.arm, elbow(-0.1)).ok());
}

TEST(Homing, EndsWhenTheArmLosesItsSupply) {
  HomingBench bench;
  bench.parameters.power_up_ticks.fill(5000);
  bench.make(false);
  bool cut = false;
  const HomingResult homed = bench.home([&](const HomingProgress&) {
    if (!std::exchange(cut, true)) bench.emulator->power_cycle();
  });
  EXPECT_EQ(homed.message(), "slew: arm: an encoder lost its reference, home again");
}

TEST(Homing, EndsWhenAsked) {
  HomingBench bench;
  bench.make(false);
  std::thread operator_who_looks([&] {
    bench.until([&] { return bench.emulator->first_motion().has_value(); });
    bench.stop = true;
  });
  const HomingResult homed = bench.home();
  operator_who_looks.join();
  EXPECT_EQ(homed.message(), "slew: arm: homing interrupted");
  EXPECT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    return bench.emulator->true_velocity_at(bench.clock.now())[kSlew] == 0;
  }));
}

TEST(Homing, EndsWhenTheArmFallsSilent) {
  HomingBench bench;
  bench.make(false);
  const HomingResult homed = bench.home([&](const HomingProgress&) { bench.emulator->set_faults({.silent = true}); });
  EXPECT_EQ(homed.message(), "slew: arm: silent");
}

TEST(Homing, EndsWhenTheLidIsOpened) {
  HomingBench bench;
  bench.make(false);
  const HomingResult homed = bench.home([&](const HomingProgress&) { bench.lid_closed = false; });
  EXPECT_EQ(homed.message(), "slew: arm: homing ended, the interlock is open");
  EXPECT_TRUE(bench.comes_to_rest());
}

TEST(Homing, EndsWhenTheLaserIsOn) {
  HomingBench bench;
  bench.make(false);
  bench.laser.stuck_on = true;
  ASSERT_TRUE(BenchRight::light(bench.laser).ok());
  const HomingResult homed = bench.home();
  EXPECT_EQ(homed.message(), "slew: laser: on though not commanded");
  EXPECT_TRUE(bench.comes_to_rest());
}

TEST(Homing, EndsWhenItWasHeldUpBetweenTwoOfItsSteps) {
  HomingBench bench;
  bench.make(false);
  bench.scan.control.heartbeat_timeout = 0.2;
  bool held_up = false;
  const HomingResult homed = bench.home([&](const HomingProgress&) {
    if (!std::exchange(held_up, true)) bench.clock.sleep_until(bench.clock.now() + 300ms);
  });
  EXPECT_EQ(homed.message(), "slew: arm: homing ended, it was held up between two of its steps");
  EXPECT_TRUE(bench.comes_to_rest());
}

TEST(Homing, EndsWhenAnActuatorIsFasterThanItMayBe) {
  HomingBench bench;
  bench.scan.limits.ticks_per_s = 1500;
  bench.make(false);
  bench.emulator->set_faults({.speed = 1.2});
  const HomingResult homed = bench.home();
  EXPECT_EQ(homed.message().find("slew: arm: homing ended, joint monitor: slew at "), 0u) << homed.message();
  EXPECT_TRUE(bench.comes_to_rest());
}

TEST(Homing, EndsWhenAnAxisGoesBeyondItsRange) {
  HomingBench bench;
  bench.model.limits[kSlew] = {-0.2, 0.2};  // what the driver believes; the emulated arm has its own
  bench.parameters.power_up[kSlew] = 0.5;
  bench.emulator = std::make_unique<ArmEmulator>(arm5e(), bench.parameters, bench.clock);
  bench.connect();
  const HomingResult homed = bench.home();
  EXPECT_EQ(homed.message(), "slew: arm: went beyond its range and found no stop");
  EXPECT_TRUE(bench.comes_to_rest());
}

TEST(Homing, RefusesAZeroThatContradictsTheOneThatHeld) {
  HomingBench bench;
  bench.power_up_near_the_stops();
  bench.make();
  ArmZero shifted{bench.emulator->true_zero(), "of this morning"};
  shifted.raw[kSlew] = static_cast<std::uint16_t>(shifted.raw[kSlew] + 40);  // the coupling slipped: 10 mrad
  bench.arm->set_zero(shifted);
  bench.state();
  const HomingResult homed = bench.home();
  EXPECT_EQ(homed.message().find("slew: arm: its stop is not where the zero that held until now has it: -"), 0u)
      << homed.message();
  EXPECT_FALSE(bench.arm->homed());
  ASSERT_TRUE(bench.home().ok()) << "nothing is left to contradict";
  const HomingResult again = bench.home();
  ASSERT_TRUE(again.ok()) << again.message();
  EXPECT_LE(std::abs(again.axes[kSlew]->from_expected_ticks.value()), 2);
  EXPECT_FALSE(again.axes[kJawRotate]->from_expected_ticks.has_value()) << "it has no stop";
}

TEST(Homing, IsRefusedFasterThanTheLimitOfActuators) {
  HomingBench bench;
  bench.scan.limits.ticks_per_s = 1000;
  bench.make(false);
  EXPECT_THROW(bench.home(), InputError);
  EXPECT_FALSE(bench.emulator->first_motion().has_value());
}

}  // namespace
}  // namespace tankrig::sim
