// When a safety step counts as completed: the one rule that guardian and watchdog box go by.
#include <gtest/gtest.h>

#include "rig/safety/guarded_outputs.hpp"
#include "tests/support/fakes.hpp"

namespace tankrig {
namespace {

using testing_support::CallLog;
using testing_support::FakeArm;
using testing_support::FakeLaser;

struct CountingWatch final : StepWatch {
  int steps = 0;
  void begin(Duration) noexcept override {}
  const char* objection(Stamp) noexcept override { return nullptr; }
  void completed(const OutputRight&) noexcept override { ++steps; }
  void release() noexcept override {}
};

struct Bench {
  CallLog log;
  FakeArm arm{log, JointVector::Zero()};
  FakeLaser laser{log};
  CountingWatch watch;
  GuardedOutputs sut{arm, laser, {}};
  Bench() { sut.tell(&watch, nullptr); }
  void decide() { sut.step({.now = Stamp{1}}); }
};

TEST(ACompletedStep, HasDecidedAndItsOutputsAreTaken) {
  Bench bench;
  for (int i = 1; i <= 3; ++i) {
    bench.decide();
    EXPECT_TRUE(bench.sut.switch_laser().ok());
    EXPECT_TRUE(bench.sut.move(JointVector::Zero()).ok());
    EXPECT_TRUE(bench.sut.complete());
    EXPECT_EQ(bench.watch.steps, i);
  }
}

TEST(ACompletedStep, IsNoneWhereLaserOrArmWasNotToldAnythingSinceTheDecision) {
  Bench bench;
  bench.decide();
  EXPECT_FALSE(bench.sut.complete());
  ASSERT_TRUE(bench.sut.laser_off().ok());
  EXPECT_FALSE(bench.sut.complete()) << "the arm was told nothing";
  ASSERT_TRUE(bench.sut.arm_stop().ok());
  EXPECT_TRUE(bench.sut.complete());
  bench.decide();
  EXPECT_FALSE(bench.sut.complete()) << "what was told before the decision does not count";
  EXPECT_EQ(bench.watch.steps, 1);
}

TEST(ACompletedStep, IsNoneWhereADriverDoesNotTakeOffOrRest) {
  Bench bench;
  bench.arm.fail_stop = true;
  bench.decide();
  ASSERT_TRUE(bench.sut.laser_off().ok());
  ASSERT_FALSE(bench.sut.arm_stop().ok());
  EXPECT_FALSE(bench.sut.complete());
  bench.arm.fail_stop = false;
  ASSERT_TRUE(bench.sut.arm_stop().ok());
  EXPECT_TRUE(bench.sut.complete()) << "the last word counts";
  EXPECT_EQ(bench.watch.steps, 1);
}

TEST(ACompletedStep, IsNoneWhereMotionWasRefused) {
  Bench bench;
  bench.sut.step({.now = Stamp{1}, .device_fault = true});
  ASSERT_TRUE(bench.sut.switch_laser().ok());
  JointVector velocity = JointVector::Zero();
  velocity[kElbow] = 0.1;
  ASSERT_FALSE(bench.sut.move(velocity).ok());
  EXPECT_FALSE(bench.sut.complete());
  TickSpeeds ticks{};
  ticks[kElbow] = 10;
  ASSERT_FALSE(bench.sut.home(ticks).ok());
  EXPECT_FALSE(bench.sut.complete());
}

}  // namespace
}  // namespace tankrig
