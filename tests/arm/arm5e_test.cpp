#include "drivers/arm/arm5e.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"
#include "sim_backends/wire/can_hub.hpp"
#include "tests/arm/arm_bench.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig::sim {
namespace {

using testing_support::ArmBench;
using testing_support::elbow;
using testing_support::Wire;
using namespace std::chrono_literals;

class Arm5eOn : public ::testing::TestWithParam<Wire> {};
INSTANTIATE_TEST_SUITE_P(Each, Arm5eOn, ::testing::ValuesIn(testing_support::kWires), testing_support::wire_name);

TEST_P(Arm5eOn, ReadsThePostureOfAHomedArm) {
  ArmBench bench(GetParam());
  bench.make();
  const JointState state = bench.state();
  for (int j = 0; j < kJoints; ++j)
    EXPECT_NEAR(state.q[j], bench.parameters.power_up[j], 1.01 * bench.model.actuators[j].resolution(state.q[j])) << j;
  EXPECT_NEAR(state.current_a, 0.2, 0.1);
  EXPECT_NEAR(bench.statistic("voltage_v"), 24, 0.2);
}

TEST_P(Arm5eOn, StampsTheMomentItsEncodersWereRead) {
  ArmBench bench(GetParam());
  bench.parameters.encoder_latency = bench.settings.encoder_latency = 4ms;
  bench.make();
  bench.state();
  std::vector<double> errors;
  ASSERT_TRUE(bench.until([&] {
    const auto news = bench.arm->try_read();
    EXPECT_TRUE(news.ok()) << news.error().where;
    EXPECT_TRUE(drive(*bench.arm, elbow(0.2)).ok());
    if (news.ok() && news.value() && news.value()->velocity[kElbow] > 0.15)
      errors.push_back(news.value()->q[kElbow] - bench.emulator->truth_at(news.value()->stamp)[kElbow]);
    return errors.size() >= 60;
  }));
  ASSERT_TRUE(bench.arm->stop().ok());
  // A reading is at most half a tick, 0.15 mrad, from the truth, and 1 ms at this speed is 0.2 mrad. A machine that is
  // too busy to keep the emulator's time delays many, but not all, by as much.
  const auto exact = std::count_if(errors.begin(), errors.end(), [](double e) { return std::abs(e) < 0.2e-3; });
  EXPECT_GE(exact, 15) << "of " << errors.size();
}

TEST_P(Arm5eOn, FollowsAVelocity) {
  ArmBench bench(GetParam());
  bench.make();
  bench.state();
  JointVector applied = JointVector::Zero();
  double reached = 0;
  ASSERT_TRUE(bench.until([&] {
    (void)bench.arm->try_read();
    const auto written = drive(*bench.arm, elbow(0.1));
    EXPECT_TRUE(written.ok());
    if (written.ok()) applied = written.value();
    reached = bench.emulator->true_velocity_at(bench.clock.now())[kElbow];
    return reached > 0.095;
  }));
  EXPECT_NEAR(applied[kElbow], 0.1, 0.5e-3);
  EXPECT_NEAR(reached, applied[kElbow], 5e-3);
  ASSERT_TRUE(bench.arm->stop().ok());
  EXPECT_TRUE(bench.until([&] { return bench.emulator->true_velocity_at(bench.clock.now())[kElbow] == 0; }));
}

TEST(OpenArm5e, SaysNothingToAnArmThatAnotherProgramMoves) {
  ArmBench bench;
  const CanHubSettings bus{.path = bench.folder.path() / "bus"};
  CanHub hub(bus);
  CanSettings listener;
  listener.interface = bench.settings.can.interface = "unix:" + bus.path.string();
  const auto ear = open_can(listener, bench.clock);
  std::size_t frames = 0;
  const auto hears = [&](std::size_t wanted) {
    return bench.until([&] {
      for (auto news = ear->try_receive(); news.ok() && news.value(); news = ear->try_receive()) ++frames;
      return frames >= wanted;
    });
  };
  bench.settings.zero_file = bench.folder.path() / "zero.yaml";
  const auto mover = open_arm5e(bench.settings, bench.model, bench.clock);
  mover->begin_motion();
  EXPECT_TRUE(hears(kJoints)) << "its stop";
  EXPECT_THAT(message_of<InputError>([&] { open_arm5e(bench.settings, bench.model, bench.clock); }),
              ::testing::HasSubstr("another program is moving the arm; wait for it to end"));
  mover->end_motion(false);
  const auto next = open_arm5e(bench.settings, bench.model, bench.clock);
  EXPECT_TRUE(hears(2 * kJoints));
  EXPECT_EQ(frames, 2 * kJoints) << "of the one that was refused too";
}

}  // namespace
}  // namespace tankrig::sim
