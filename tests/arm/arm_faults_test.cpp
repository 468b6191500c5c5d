// What goes wrong on the arm's wires, and what the cycle is told of it.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <thread>

#include "sim_backends/wire/can_hub.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/held_thread.hpp"

namespace tankrig::sim {
namespace {

using tankrig::testing_support::HeldThread;
using testing_support::ArmBench;
using testing_support::elbow;
using testing_support::Wire;
using namespace std::chrono_literals;

class ArmFaultsOn : public ::testing::TestWithParam<Wire> {};
INSTANTIATE_TEST_SUITE_P(Each, ArmFaultsOn, ::testing::ValuesIn(testing_support::kWires), testing_support::wire_name);

/// States still come.
void expect_states(ArmBench& bench, int wanted = 10) {
  int states = 0;
  EXPECT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    states += news.ok() && news.value();
    return states >= wanted;
  }));
}

/// At least so many, as the driver goes on.
void expect_count(ArmBench& bench, const std::string& name, double wanted) {
  EXPECT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    return bench.statistic(name) >= wanted;
  })) << name
      << " " << bench.statistic(name);
}

TEST_P(ArmFaultsOn, ASilentArmIsATimeoutAndComesBack) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  bench.emulator->set_faults({.silent = true});
  const Error error = bench.error();
  EXPECT_EQ(error.code, ErrorCode::kTimeout);
  EXPECT_STREQ(error.where, "arm: silent");
  expect_count(bench, "timeouts", 1);
  expect_count(bench, "mute_retries", 1);
  bench.emulator->set_faults({});
  expect_states(bench);
  EXPECT_TRUE(bench.arm->homed());
}

TEST_P(ArmFaultsOn, AnAnswerThatNobodyHasLookedForIsNoTimeout) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  bench.clock.sleep_until(bench.clock.now() + 2 * bench.arm->exchange_period());  // the next request is due
  EXPECT_TRUE(drive(*bench.arm, elbow(0.1)).ok());
  const double timeouts = bench.statistic("timeouts");
  EXPECT_TRUE(bench.arm->stop().ok());
  bench.clock.sleep_until(bench.clock.now() + 4 * bench.settings.reply_timeout);  // later than any answer
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_EQ(bench.statistic("timeouts"), timeouts);
  expect_states(bench);
}

TEST_P(ArmFaultsOn, AnArmThatNeverAnswersIsSilentToo) {
  ArmBench bench(GetParam());
  bench.make();
  bench.emulator->set_faults({.silent = true});
  EXPECT_STREQ(bench.error().where, "arm: silent");
}

/// Nobody would notice an over-current. (A serial frame without the master's bytes has no right sum.)
TEST(ArmFaults, ACanArmThatNoLongerTellsItsCurrentIsSilent) {
  for (const Wire wire : {Wire::kPair, Wire::kFastPair}) {
    ArmBench bench(wire);
    bench.make();
    bench.state();
    bench.emulator->set_faults({.no_master = true});
    EXPECT_STREQ(bench.error().where, "arm: silent");
    const double heard = bench.statistic("exchanges") + 30;
    int states = 0;
    EXPECT_TRUE(bench.until([&] {
      const auto news = bench.arm->try_read();
      states += news.ok() && news.value();
      return bench.statistic("exchanges") >= heard;
    })) << "its joints are still read";
    EXPECT_EQ(states, 0) << "it has not told it since";
    bench.emulator->set_faults({});
    expect_states(bench);
  }
}

TEST_P(ArmFaultsOn, GarbageBeforeEveryAnswerIsCountedAndPassedOver) {
  ArmBench bench(GetParam());
  bench.make();
  bench.emulator->set_faults({.garbage = true});
  expect_states(bench);
  if (GetParam() != Wire::kPty) {
    expect_count(bench, "wrong_ids", 10);
  } else {
    expect_count(bench, "discarded_bytes", 10);
    expect_count(bench, "resyncs", 5);
  }
}

TEST_P(ArmFaultsOn, AnswersThatAreCutOffAreSilence) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  bench.emulator->set_faults({.truncated = true});
  const Error error = bench.error();
  EXPECT_STREQ(error.where, "arm: silent");
  expect_count(bench, GetParam() == Wire::kPty ? "length_errors" : "incomplete", 1);
  bench.emulator->set_faults({});
  expect_states(bench);
}

TEST(ArmFaults, AWrongChecksumIsSilenceAndCounted) {
  ArmBench bench(Wire::kPty);
  bench.make();
  bench.state();
  bench.emulator->set_faults({.wrong_checksum = true});
  EXPECT_STREQ(bench.error().where, "arm: silent");
  expect_count(bench, "checksum_errors", 2);
  bench.emulator->set_faults({});
  expect_states(bench);
}

TEST(ArmFaults, WrongIdentifiersAndLengthsAreSilenceAndCounted) {
  ArmBench bench;
  bench.make();
  bench.state();
  bench.emulator->set_faults({.wrong_ids = true});
  EXPECT_STREQ(bench.error().where, "arm: silent");
  expect_count(bench, "wrong_ids", 12);
  bench.emulator->set_faults({.wrong_lengths = true});
  expect_count(bench, "wrong_lengths", 5);
  bench.emulator->set_faults({});
  expect_states(bench);
}

TEST_P(ArmFaultsOn, ReadingsThatRepeatWhileItIsDrivenAreATimeout) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  bench.emulator->set_faults({.stale = true});
  expect_states(bench);  // at rest nothing is wrong with them
  EXPECT_EQ(bench.statistic("stale"), 0);
  const Error error = bench.error(elbow(0.1));
  EXPECT_EQ(error.code, ErrorCode::kTimeout);
  EXPECT_STREQ(error.where, "arm: repeats old readings though it is driven");
  EXPECT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    (void)drive(*bench.arm, elbow(0.1));
    return bench.statistic("stale") >= 3;
  }));
  EXPECT_TRUE(bench.arm->stop().ok());
}

TEST_P(ArmFaultsOn, NoReadingThatRepeatsWhatItReadWhileTheArmWasDrivenTellsThatItRests) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  ASSERT_TRUE(bench.elbow_swings());
  bench.emulator->set_faults({.stale = true});
  EXPECT_STREQ(bench.error(elbow(0.1)).where, "arm: repeats old readings though it is driven");
  const double heard = bench.statistic("exchanges");
  int states = 0;
  EXPECT_TRUE(bench.until([&] {
    EXPECT_TRUE(bench.arm->stop().ok());
    const auto news = bench.arm->try_read();
    states += news.ok() && news.value();
    return bench.statistic("exchanges") > heard + 20;
  }));
  EXPECT_EQ(states, 0);
  bench.emulator->set_faults({});
  expect_states(bench);  // the elbow stands elsewhere
}

TEST_P(ArmFaultsOn, WaterInAHousingStopsTheArmForGood) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  bench.emulator->set_faults({.water_joint = kElbow});
  const Error error = bench.error(elbow(0.1));
  EXPECT_EQ(error.code, ErrorCode::kOutOfRange);
  EXPECT_STREQ(error.where, "arm: water in a joint's housing");
  EXPECT_GE(bench.arm->readings().water[kElbow], 1);
  expect_states(bench);  // it can still be seen coming to rest
  EXPECT_STREQ(drive(*bench.arm, elbow(0.1)).error().where, "arm: water in a joint's housing");
  ASSERT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    return bench.emulator->true_velocity_at(bench.clock.now())[kElbow] == 0;
  }));
  bench.emulator->set_faults({});
  expect_states(bench);
  EXPECT_FALSE(drive(*bench.arm, elbow(0.1)).ok()) << "for good";
  EXPECT_EQ(bench.statistic("water_alarms"), 1);
}

TEST_P(ArmFaultsOn, TooMuchCurrentForTooLongStopsTheArmForGood) {
  ArmBench bench(GetParam());
  bench.settings.over_current.duration = 200ms;
  bench.make();
  bench.state();
  bench.emulator->set_faults({.extra_current_a = 2.5});
  const Stamp begin = bench.clock.now();
  const Error error = bench.error(elbow(0.1));
  EXPECT_GE(bench.clock.now() - begin, 200ms);
  EXPECT_EQ(error.code, ErrorCode::kOverCurrent);
  EXPECT_STREQ(error.where, "arm: over-current for too long");
  EXPECT_NEAR(bench.statistic("current_a"), 2.7, 0.3);
  bench.emulator->set_faults({});
  expect_states(bench);
  EXPECT_FALSE(drive(*bench.arm, elbow(0.1)).ok()) << "for good";
}

TEST_P(ArmFaultsOn, AnArmThatGoesMuteAnswersTheAlteredFrame) {
  ArmBench bench(GetParam());
  bench.parameters.mute_probability = 0.3;
  bench.parameters.seed = 5;
  bench.settings.silence_timeout = 2s;
  bench.make();
  bench.state();
  int states = 0;
  EXPECT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    EXPECT_TRUE(news.ok()) << news.error().where;
    states += news.ok() && news.value();
    return (states >= 10 && bench.statistic("mute_retries") >= 1) || !news.ok();
  })) << states
      << " states, seed " << bench.parameters.seed;
}

TEST_P(ArmFaultsOn, ZeroPeaksAreRejectedAndCounted) {
  ArmBench bench(GetParam());
  bench.parameters.power_up_ticks = {5000, 6000, 7000, 8000, 9000};
  bench.parameters.zero_peak_probability = 0.05;
  bench.make();
  bench.state();
  double worst = 0;
  int states = 0;
  ASSERT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    EXPECT_TRUE(news.ok()) << news.error().where;
    if (news.ok() && news.value()) {
      worst = std::max(worst, (news.value()->q - bench.parameters.power_up).cwiseAbs().maxCoeff());
      ++states;
    }
    return states >= 40 && bench.statistic("jumps_rejected") >= 1;
  }));
  EXPECT_LT(worst, 2e-3);
}

TEST_P(ArmFaultsOn, EncodersThatStartAnewEndTheHoming) {
  ArmBench bench(GetParam());
  bench.parameters.power_up_ticks = {5000, 6000, 7000, 8000, 9000};
  bench.make();
  bench.state();
  bench.emulator->power_cycle();
  const Error error = bench.error();
  EXPECT_EQ(error.code, ErrorCode::kNotReady);
  EXPECT_STREQ(error.where, "arm: an encoder lost its reference, home again");
  EXPECT_FALSE(bench.arm->homed());
  EXPECT_FALSE(drive(*bench.arm, elbow(0.1)).ok());
  expect_states(bench, 3 * ExchangeSchedule::kFastRound);  // every encoder has told its new place
  bench.arm->set_zero({bench.emulator->true_zero(), "again"});
  expect_states(bench);
  EXPECT_TRUE(drive(*bench.arm, elbow(0.1)).ok());
}

TEST_P(ArmFaultsOn, AZeroThatPutsAJointBeyondItsLimitsIsRefused) {
  ArmBench bench(GetParam());
  bench.make(false);
  ArmZero wrong{bench.emulator->true_zero(), "of another day"};
  wrong.raw[kElbow] = static_cast<std::uint16_t>(wrong.raw[kElbow] + 12'000);
  bench.arm->set_zero(wrong);
  EXPECT_STREQ(bench.error().where, "arm: a joint outside its limits, home again");
  EXPECT_FALSE(bench.arm->homed());
}

TEST_P(ArmFaultsOn, WithoutSetPointsTheDriverStopsTheArmThoughTheCycleHangs) {
  ArmBench bench(GetParam());
  bench.settings.watchdog = 150ms;
  bench.parameters.watchdog = 0ms;  // the arm itself would run on
  bench.make();
  bench.state();
  ASSERT_TRUE(bench.elbow_swings());
  // From here on nobody calls the driver.
  EXPECT_TRUE(bench.until([&] { return bench.emulator->true_velocity_at(bench.clock.now())[kElbow] == 0; }));
  EXPECT_EQ(bench.statistic("watchdog_stops"), 1);
}

/// The first stop goes into a line that is pulled; nobody calls the driver when the line is back.
TEST(ArmFaults, AnArmThatIsLeftIsAskedToRestOnTheLineThatCameBack) {
  ArmBench bench(Wire::kPty);
  bench.settings.watchdog = 150ms;
  bench.parameters.watchdog = 0ms;  // the arm itself would run on
  bench.make();
  bench.state();
  ASSERT_TRUE(bench.elbow_swings());
  bench.emulator->unplug();
  EXPECT_TRUE(bench.until([&] { return bench.statistic("watchdog_stops") == 1; }));
  EXPECT_FALSE(bench.emulator->rest_since()) << "it is out of reach";
  bench.emulator->plug();
  EXPECT_TRUE(bench.until([&] { return bench.emulator->rest_since().has_value(); }));
}

TEST_P(ArmFaultsOn, AThreadOfItsOwnThatHangsIsTold) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  {
    const HeldThread held("arm-keeper");
    ASSERT_TRUE(held.found());
    const Error error = bench.error();
    EXPECT_EQ(error.code, ErrorCode::kInternal);
    EXPECT_STREQ(error.where, "arm: its thread is dead or stuck");
  }
  EXPECT_TRUE(bench.until([&] { return bench.arm->try_read().ok(); })) << "it goes round again";
}

TEST_P(ArmFaultsOn, SilenceCountsFromWhenSomebodyListens) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  for (const Duration preparation : {150ms, 300ms, 700ms}) {
    bench.clock.sleep_until(bench.clock.now() + preparation);  // as locking the program's memory takes
    const auto first = bench.arm->try_read();
    EXPECT_TRUE(first.ok()) << first.error().where;
  }
  bench.emulator->set_faults({.silent = true});
  EXPECT_STREQ(bench.error().where, "arm: silent");
}

TEST_P(ArmFaultsOn, TheArmsOwnWatchdogStopsItWhenTheHostIsGone) {
  ArmBench bench(GetParam());
  bench.parameters.watchdog = 150ms;
  bench.settings.watchdog = 10s;
  bench.make();
  bench.state();
  ASSERT_TRUE(bench.elbow_swings());
  EXPECT_TRUE(bench.until([&] { return bench.emulator->true_velocity_at(bench.clock.now())[kElbow] == 0; }));
}

TEST(ArmFaults, OpeningStopsAnArmThatAKilledProgramLeftMoving) {
  ArmBench bench(Wire::kPty);
  bench.parameters.watchdog = Duration{0};
  bench.emulator = std::make_unique<ArmEmulator>(bench.model, bench.parameters, bench.clock);
  bench.emulator->serve(bench.folder.path() / "arm");
  const auto moves = [&] { return bench.emulator->true_velocity_at(bench.clock.now())[kElbow] != 0; };
  const pid_t program = ::fork();
  if (program == 0) {
    bench.arm = open_arm5e(bench.settings, bench.model, bench.clock);
    while (true) {
      (void)bench.arm->try_read();
      (void)drive_ticks(*bench.arm, {0, 0, 100, 0, 0});
      bench.clock.sleep_until(bench.clock.now() + 5ms);
    }
  }
  EXPECT_TRUE(bench.until(moves));
  ::kill(program, SIGKILL);
  ::waitpid(program, nullptr, 0);
  EXPECT_TRUE(moves());
  bench.arm = open_arm5e(bench.settings, bench.model, bench.clock);
  EXPECT_TRUE(bench.until([&] { return !moves(); }));
}

TEST_P(ArmFaultsOn, MayBeStoppedFromAnyThreadWhileTheCycleRuns) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  std::atomic<bool> done{false};
  std::thread other([&] {
    while (!done) {
      EXPECT_TRUE(bench.arm->stop().ok());
      std::this_thread::yield();
    }
  });
  int refused = 0;
  bench.until(
      [&] {
        refused += !bench.arm->try_read().ok();
        refused += !drive(*bench.arm, elbow(0.1)).ok();
        return false;
      },
      400ms);
  done = true;
  other.join();
  EXPECT_EQ(refused, 0);
  std::thread([&] { EXPECT_TRUE(bench.arm->stop().ok()); }).join();
  EXPECT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    return bench.emulator->true_velocity_at(bench.clock.now())[kElbow] == 0;
  }));
  expect_states(bench);
}

TEST(ArmFaults, APulledSerialPlugIsADisconnectionAndItsReturnIsFound) {
  ArmBench bench(Wire::kPty);
  bench.make();
  bench.state();
  bench.emulator->unplug();
  const Error error = bench.error();
  EXPECT_EQ(error.code, ErrorCode::kDisconnected);
  EXPECT_STREQ(error.where, "arm: carrier lost");
  EXPECT_EQ(drive(*bench.arm, elbow(0.1)).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(bench.statistic("disconnects"), 1);
  bench.emulator->plug();
  expect_states(bench);
  EXPECT_EQ(bench.statistic("reopened"), 1);
  ASSERT_TRUE(bench.elbow_swings());
}

TEST(ArmFaults, OverTheHubTheArmSurvivesThatTheBusGoesAwayAndComesBack) {
  ArmBench bench;
  bench.parameters.can_paced = false;  // the hub is
  CanHubSettings bus{.path = bench.folder.path() / "bus"};
  auto hub = std::make_unique<CanHub>(bus);
  const std::string interface = "unix:" + bus.path.string();
  bench.emulator = std::make_unique<ArmEmulator>(bench.model, bench.parameters, bench.clock);
  CanSettings device;
  device.interface = bench.settings.can.interface = interface;
  bench.emulator->serve(open_can(device, bench.clock));
  bench.arm = open_arm5e(bench.settings, bench.model, bench.clock);
  bench.arm->set_zero({bench.emulator->true_zero(), "by truth"});
  const JointState before = bench.state();
  EXPECT_NEAR(before.q[kElbow], bench.parameters.power_up[kElbow], 1e-3);
  hub.reset();
  const Error error = bench.error();
  EXPECT_EQ(error.code, ErrorCode::kDisconnected);
  EXPECT_STREQ(error.where, "arm: carrier lost");
  hub = std::make_unique<CanHub>(bus);
  expect_states(bench);
  EXPECT_GE(bench.statistic("reopened"), 1);
}

TEST(ArmFaults, AnEmptyOrFullWireIsNoErrorOfTheCycle) {
  // The emulator's end of the pair is there but never read: the driver's queue fills up.
  ArmBench bench;
  auto [driver, device] = make_can_pair(bench.clock);
  bench.settings.reply_timeout = 1ms;
  bench.settings.exchange_rate_hz = 200;
  bench.settings.silence_timeout = 3s;
  bench.arm = std::make_unique<Arm5e>(
      bench.settings, bench.model,
      std::make_unique<CanArmLink>(std::move(driver), bench.settings.can_ids, bench.settings.can.bitrate), bench.clock);
  ASSERT_TRUE(bench.until([&] {
    EXPECT_TRUE(bench.arm->try_read().ok());
    (void)drive_ticks(*bench.arm, {});
    return bench.statistic("send_buffer_full") > 0;
  }));
}

}  // namespace
}  // namespace tankrig::sim
