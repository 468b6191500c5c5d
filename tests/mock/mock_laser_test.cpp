#include "sim_backends/mock/mock_laser.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/bench_right.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

TEST(MockLaser, EmitsAfterItsWarmUpAndGoesDarkAtOnce) {
  VirtualClock clock;
  MockLaser sut(1s, clock);
  EXPECT_FALSE(sut.state().value().powered);
  clock.sleep_until({2'000'000'000});
  ASSERT_TRUE(BenchRight::light(sut).ok());
  EXPECT_TRUE(sut.state().value().powered);
  EXPECT_FALSE(sut.state().value().emitting);
  clock.sleep_until({3'000'000'000});
  EXPECT_TRUE(sut.state().value().emitting);
  EXPECT_EQ(sut.state().value().since, Stamp{3'000'000'000});
  clock.sleep_until({5'000'000'000});
  ASSERT_TRUE(sut.off().ok());
  EXPECT_FALSE(sut.state().value().emitting);
  EXPECT_EQ(sut.state().value().since, Stamp{5'000'000'000});
}

TEST(MockLaser, RemembersWhenItShone) {
  VirtualClock clock;
  MockLaser sut(1s, clock);
  clock.sleep_until({2'000'000'000});
  ASSERT_TRUE(BenchRight::light(sut).ok());
  clock.sleep_until({5'000'000'000});
  ASSERT_TRUE(sut.off().ok());
  EXPECT_EQ(sut.power_at({1'000'000'000}), 0);
  EXPECT_EQ(sut.power_at({2'999'999'999}), 0);
  EXPECT_EQ(sut.power_at({3'000'000'000}), 1);
  EXPECT_EQ(sut.power_at({4'999'999'999}), 1);
  EXPECT_EQ(sut.power_at({5'000'000'000}), 0);
}

TEST(MockLaser, StaysDarkIfSwitchedOffWhileWarmingUp) {
  VirtualClock clock;
  MockLaser sut(1s, clock);
  ASSERT_TRUE(BenchRight::light(sut).ok());
  clock.sleep_until({500'000'000});
  ASSERT_TRUE(sut.off().ok());
  for (std::int64_t t = 0; t < 3'000'000'000; t += 100'000'000) EXPECT_EQ(sut.power_at({t}), 0);
}

TEST(MockLaser, FailsInTheWaysATestAsksFor) {
  VirtualClock clock;
  MockLaser sut(0s, clock);
  sut.faults.set_fails = true;
  EXPECT_EQ(BenchRight::light(sut).error().code, ErrorCode::kIo);
  EXPECT_FALSE(sut.state().value().powered);
  sut.faults = {};
  sut.faults.dead = true;
  ASSERT_TRUE(BenchRight::light(sut).ok());
  EXPECT_TRUE(sut.state().value().powered);
  EXPECT_FALSE(sut.state().value().emitting);
  sut.faults = {};
  sut.faults.stuck_on = true;
  ASSERT_TRUE(sut.off().ok());
  EXPECT_FALSE(sut.state().value().commanded);
  EXPECT_TRUE(sut.state().value().powered);
  EXPECT_TRUE(sut.state().value().emitting);
}

TEST(MockLaser, MayBeSwitchedOffFromAnyThread) {
  MonotonicClock clock;
  MockLaser sut(0s, clock);
  const Stamp begin = clock.now();
  std::atomic<bool> done{false};
  std::thread other([&] {
    while (!done) (void)sut.off();
  });
  int lit = 0;
  for (int i = 0; i < 200'000; ++i) {
    (void)BenchRight::light(sut);
    const LaserState s = sut.state().value();
    EXPECT_EQ(s.emitting, s.powered);
    EXPECT_GE(s.since, begin);
    lit += s.powered;
  }
  done = true;
  other.join();
  ASSERT_TRUE(sut.off().ok());
  EXPECT_FALSE(sut.state().value().powered);
  EXPECT_GT(lit, 0);
}

TEST(MockLaser, RemembersManySwitchings) {
  VirtualClock clock;
  MockLaser sut(0s, clock);
  for (int i = 0; i < 1000; ++i) {
    clock.sleep_until({i * 10});
    ASSERT_TRUE((i % 2 == 0 ? BenchRight::light(sut) : sut.off()).ok());
  }
  for (int i = 800; i < 1000; ++i) EXPECT_EQ(sut.power_at({i * 10 + 5}), i % 2 == 0 ? 1 : 0);
}

}  // namespace
}  // namespace tankrig::sim
