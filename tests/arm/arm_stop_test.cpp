// What a stop puts on the bus, and what it says, where the send queue cut a request or nobody commands.
#include <gtest/gtest.h>

#include "tests/arm/still_arm.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::StillArm;

constexpr std::array<int, kJoints> kElbowMoves{0, 0, 1000, 0, 0}, kElbowCreeps{0, 0, 40, 0, 0};
constexpr auto kFirstThree = std::size_t{3};  // of a request's five frames: the elbow's too

TEST(ArmStop, IsRepeatedOnlyWhenAnExchangeIsDue) {
  StillArm bench;
  EXPECT_TRUE(bench.arm->stop().ok());
  const std::size_t sent = bench.bus->sent.size();
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_EQ(bench.bus->sent.size(), sent);
  bench.pass();
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_EQ(bench.bus->sent.size(), sent + kJoints);
}

TEST(ArmStop, OfARequestThatTheQueueCutHalfWayIsAtOnceAndNotOkUntilItIsSent) {
  StillArm bench;
  EXPECT_TRUE(bench.arm->stop().ok());
  bench.pass();
  bench.bus->room = bench.bus->sent.size() + kFirstThree;
  EXPECT_TRUE(drive_ticks(*bench.arm, kElbowMoves).ok()) << "a full queue is no error of a set-point";
  ASSERT_FALSE(bench.rests());
  const Status refused = bench.arm->stop();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  bench.bus->room = 1000;
  EXPECT_TRUE(bench.arm->stop().ok());
  EXPECT_TRUE(bench.rests());
}

TEST(ArmStop, OfTheWatchdogAlsoEndsTheSlowestDemand) {
  StillArm bench;
  EXPECT_TRUE(drive_ticks(*bench.arm, kElbowCreeps).ok());
  ASSERT_FALSE(bench.rests());
  bench.pass(bench.settings.watchdog + 1ms);
  (void)bench.arm->try_read();
  EXPECT_TRUE(bench.rests());
}

}  // namespace
}  // namespace tankrig
