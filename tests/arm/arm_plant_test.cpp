#include "sim_backends/world/arm_plant.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

const JointVector kPosture = (JointVector() << 0, 0.12, 1.0, 0, 0.1).finished();
constexpr Stamp kStart{1'000'000'000};

std::array<double, kJoints> elbow_speed(double ticks_per_s) { return {0, 0, ticks_per_s, 0, 0}; }

TEST(ArmPlant, FollowsADemandWithFirstOrderLagExactly) {
  ArmPlantParameters parameters;
  parameters.time_constant = 0.05;
  ArmPlant sut(arm5e(), parameters, kPosture, kStart);
  const double begin = sut.axes_at(kStart)[kElbow].ticks;
  sut.drive(kStart + 10ms, elbow_speed(-400));
  for (const double t : {0.0, 0.003, 0.05, 0.2}) {
    const ArmPlant::Axis axis = sut.axes_at(kStart + 10ms + from_seconds(t))[kElbow];
    EXPECT_NEAR(axis.ticks, begin - 400 * (t - 0.05 * (1 - std::exp(-t / 0.05))), 1e-9) << t;
    EXPECT_NEAR(axis.speed, -400 * (1 - std::exp(-t / 0.05)), 1e-9) << t;
  }
  EXPECT_EQ(sut.axes_at(kStart + 5ms)[kElbow].ticks, begin);
}

TEST(ArmPlant, IsTheSameHoweverOftenADemandIsRepeated) {
  ArmPlant once(arm5e(), {}, kPosture, kStart), often(arm5e(), {}, kPosture, kStart);
  once.drive(kStart, elbow_speed(-300));
  for (int i = 0; i < 500; ++i) often.drive(kStart + i * 1ms, elbow_speed(-300));
  EXPECT_NEAR(once.truth_at(kStart + 1s)[kElbow], often.truth_at(kStart + 1s)[kElbow], 1e-12);
}

TEST(ArmPlant, StaysPutBelowItsStiction) {
  ArmPlantParameters parameters;
  parameters.stiction_ticks_per_s.fill(100);
  ArmPlant sut(arm5e(), parameters, kPosture, kStart);
  sut.drive(kStart, elbow_speed(-99));
  EXPECT_EQ(sut.truth_at(kStart + 1s), sut.truth_at(kStart));
  sut.drive(kStart + 1s, elbow_speed(-100));
  EXPECT_GT(sut.truth_at(kStart + 2s)[kElbow], sut.truth_at(kStart)[kElbow] + 0.009);
}

TEST(ArmPlant, StopsHardAtItsLimitsAndTakesMoreCurrentThere) {
  ArmPlantParameters parameters;
  const ArmModel model = arm5e();
  ArmPlant sut(model, parameters, kPosture, kStart);
  EXPECT_EQ(sut.current_at(kStart), parameters.quiescent_a);
  sut.drive(kStart, elbow_speed(-2000));
  const double moving = sut.current_at(kStart + 1s);
  EXPECT_NEAR(moving, parameters.quiescent_a + 2000 * parameters.current_a_per_tick_s, 1e-9);
  sut.drive(kStart + 10s, elbow_speed(-2000));
  EXPECT_NEAR(sut.truth_at(kStart + 11s)[kElbow], model.limits[kElbow].upper, 1e-9);
  EXPECT_NEAR(sut.current_at(kStart + 11s), parameters.quiescent_a + parameters.stall_a, 1e-6);
  sut.drive(kStart + 11s, elbow_speed(0));
  EXPECT_EQ(sut.current_at(kStart + 11s + 1ms), parameters.quiescent_a);
}

TEST(ArmPlant, LosesItsBacklashWhenItTurnsAround) {
  ArmPlantParameters parameters;
  parameters.backlash_ticks[kElbow] = 20;
  ArmPlant sut(arm5e(), parameters, kPosture, kStart);
  sut.drive(kStart, elbow_speed(-400));
  ArmPlant::Axis axis = sut.axes_at(kStart + 1s)[kElbow];
  EXPECT_NEAR(axis.link - axis.ticks, 10, 1e-9);
  sut.drive(kStart + 1s, elbow_speed(400));
  axis = sut.axes_at(kStart + 2s)[kElbow];
  EXPECT_NEAR(axis.link - axis.ticks, -10, 1e-9);
}

TEST(ArmPlant, AnswersWithItsOldestMemoryBeforeIt) {
  ArmPlant sut(arm5e(), {}, kPosture, kStart);
  for (std::int64_t i = 0; i < 2 * ArmPlant::kHistory; ++i)
    sut.drive(kStart + i * 1ms, elbow_speed(i % 400 < 200 ? -500 : 500));
  const JointVector oldest = sut.truth_at(kStart + (ArmPlant::kHistory)*1ms);
  EXPECT_EQ(sut.truth_at(kStart), oldest);
  EXPECT_NE(sut.truth_at(kStart + (ArmPlant::kHistory + 100) * 1ms), oldest);
}

TEST(ArmPlant, LetsNoDemandRewriteThePast) {
  ArmPlant sut(arm5e(), {}, kPosture, kStart);
  sut.drive(kStart + 100ms, elbow_speed(-500));
  const JointVector before = sut.truth_at(kStart + 100ms);
  sut.drive(kStart + 50ms, elbow_speed(500));
  EXPECT_EQ(sut.truth_at(kStart + 100ms), before);
}

TEST(ArmPlant, TellsTheTruthToOtherThreadsWhileItIsDriven) {
  ArmPlant sut(arm5e(), {}, kPosture, kStart);
  std::atomic<std::int64_t> driven_ms{0};
  std::atomic<bool> done{false};
  std::thread other([&] {
    while (!done) {
      const std::int64_t ms = driven_ms;
      const double a = sut.truth_at(kStart + ms * 1ms)[kElbow], b = sut.truth_at(kStart + ms * 1ms)[kElbow];
      if (ms + ArmPlant::kHistory > driven_ms + 10) {
        EXPECT_EQ(a, b);
      }
    }
  });
  for (int i = 0; i < 20'000; ++i) {
    sut.drive(kStart + i * 1ms, elbow_speed(-100));
    driven_ms = i;
  }
  done = true;
  other.join();
}

}  // namespace
}  // namespace tankrig::sim
