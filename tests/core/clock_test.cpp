// Clocks keep their promise on sleep_until.
#include "core/clock.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

TEST(VirtualClock, MovesOnlyForwardAndOnlyWhenAsked) {
  VirtualClock sut(Stamp{100});
  EXPECT_EQ(sut.now().ns, 100);
  sut.sleep_until(Stamp{250});
  EXPECT_EQ(sut.now().ns, 250);
  sut.sleep_until(Stamp{200});
  EXPECT_EQ(sut.now().ns, 250);
}

TEST(MonotonicClock, DoesNotReturnBeforeTheAskedInstant) {
  MonotonicClock sut;
  const Stamp when = sut.now() + from_seconds(0.002);
  sut.sleep_until(when);
  EXPECT_GE(sut.now(), when);
}

TEST(Time, SecondsAndNanosecondsRoundTrip) {
  EXPECT_EQ(from_seconds(-0.25).count(), -250'000'000);
  EXPECT_DOUBLE_EQ(seconds(Stamp{3'000'000'000} - Stamp{1'500'000'000}), 1.5);
}

}  // namespace
}  // namespace tankrig
