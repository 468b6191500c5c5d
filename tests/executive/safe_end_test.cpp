// What is confirmed at the end of a scan, and for how long it stays confirmed.
#include "rig/executive/safe_end.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kCycle = 5ms;

/// Records of an executive that has stopped, the laser dark.
struct EndBench {
  SafetySettings settings;
  SafeEnd sut{settings};
  Stamp now{1'000'000'000};

  void cycles(Duration time, bool news, double velocity = 0, ExecutiveState state = ExecutiveState::kStopped) {
    for (const Stamp end = now + time; now < end;) {
      now = now + kCycle;
      CycleRecord record;
      record.stamp = record.joints.stamp = now;
      record.state = state;
      record.laser.emplace();
      record.has_joints = news;
      record.joints.velocity[kElbow] = velocity;
      sut.add(record);
    }
  }
};

TEST(SafeEnd, IsConfirmedByAnArmThatIsSeenAtRestAndALaserThatIsReadDark) {
  EndBench bench;
  bench.cycles(1s, true, 0, ExecutiveState::kRunning);
  EXPECT_FALSE(bench.sut.ended());
  bench.cycles(RestWatch::kWindow, true);
  EXPECT_FALSE(bench.sut.settled());
  bench.cycles(2 * kCycle, true);
  EXPECT_TRUE(bench.sut.settled());
  EXPECT_EQ(to_string(bench.sut.left()), "laser off, arm at rest");
}

TEST(SafeEnd, OfAnArmThatGivesNoNewsIsNeverAtRest) {
  EndBench bench;
  bench.cycles(1s, true, 0, ExecutiveState::kRunning);
  bench.cycles(from_seconds(bench.settings.rest_timeout) + 2 * kCycle, false);
  EXPECT_TRUE(bench.sut.settled()) << "it does not wait for ever";
  EXPECT_EQ(to_string(bench.sut.left()), "laser off; ARM MAY BE MOVING: cut its power");
}

TEST(SafeEnd, IsTakenBackWhenTheArmIsNotHeardOfAnyMore) {
  EndBench bench;
  bench.cycles(1s, true);
  ASSERT_TRUE(bench.sut.left().arm_at_rest);
  bench.cycles(SafeEnd::kNewsAge, false);
  EXPECT_TRUE(bench.sut.left().arm_at_rest);
  bench.cycles(kCycle, false);
  EXPECT_FALSE(bench.sut.left().arm_at_rest);
  bench.cycles(kCycle, true);
  EXPECT_TRUE(bench.sut.left().arm_at_rest);
}

TEST(SafeEnd, IsTakenBackWhenTheArmMovesAgain) {
  EndBench bench;
  bench.cycles(1s, true);
  bench.cycles(kCycle, true, 0.2);
  EXPECT_FALSE(bench.sut.left().arm_at_rest);
}

}  // namespace
}  // namespace tankrig
