// A suspension is seen once and never wrongly, whatever happens to the thread that reads the clocks.
#include "core/suspend_watch.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

TimeAsleep exactly(Duration asleep) { return {asleep, asleep}; }

TEST(SuspendWatch, SeesASuspensionOnceAndNoneAtItsFirstLook) {
  SuspendWatch sut;
  EXPECT_FALSE(sut.look(exactly(3h))) << "before anybody watched";
  EXPECT_FALSE(sut.look(exactly(3h)));
  EXPECT_TRUE(sut.look(exactly(3h + 20ms)));
  EXPECT_FALSE(sut.look(exactly(3h + 20ms)));
  EXPECT_TRUE(sut.look(exactly(11h)));
}

/// The machine as CLOCK_MONOTONIC and CLOCK_BOOTTIME show it, to a reader that is held up at random between any two of
/// its three readings, for up to a minute.
TEST(SuspendWatch, IsNotMisledByAThreadThatLosesItsProcessorWhileItReads) {
  constexpr unsigned kSeed = 20260611;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  const auto held_up = [&] { return Duration{random() % 10 == 0 ? random() % 60'000'000'000ULL : random() % 1000}; };
  std::int64_t now = 0, asleep = 5'000'000'000;
  SuspendWatch sut;
  const auto look = [&] {
    const std::int64_t before = now, boot = (now += held_up().count()) + asleep, after = now += held_up().count();
    return sut.look({Duration{boot - after}, Duration{boot - before}});
  };
  for (int i = 0; i < 10'000; ++i) ASSERT_FALSE(look()) << "look " << i;
  for (int i = 0; i < 100; ++i) {
    asleep += 2'000'000'000;
    int looks = 1;
    while (!look()) ASSERT_LT(++looks, 1000) << "suspension " << i;
    for (int j = 0; j < 100; ++j) ASSERT_FALSE(look()) << "after suspension " << i;
  }
}

TEST(MonotonicClock, BoundsTheTimeAsleepAndIsItselfNotSeenToSleep) {
  const MonotonicClock clock;
  SuspendWatch sut;
  for (int i = 0; i < 100'000; ++i) {
    const TimeAsleep asleep = clock.asleep();
    ASSERT_LE(asleep.at_least, asleep.at_most);
    ASSERT_FALSE(sut.look(asleep)) << "look " << i;
  }
}

TEST(VirtualClock, SleepsWhenItIsToldAndItsTimeStandsStillMeanwhile) {
  VirtualClock clock(Stamp{100});
  SuspendWatch sut;
  EXPECT_FALSE(sut.look(clock.asleep()));
  clock.suspend(8h);
  EXPECT_EQ(clock.now(), Stamp{100});
  EXPECT_TRUE(sut.look(clock.asleep()));
}

}  // namespace
}  // namespace tankrig
