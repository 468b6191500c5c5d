#include "rig/safety/still_watch.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// Feeds an elbow encoder every 10 ms; when the watch first says rest, or nothing within `for_so_long`.
template <class Ticks>
std::optional<Duration> first_rest(Ticks ticks, Duration for_so_long = 5s) {
  StillWatch watch;
  for (int i = 0; i * 10ms <= for_so_long; ++i) {
    JointState state;
    state.stamp = Stamp{} + i * 10ms;
    state.ticks.fill(1000);
    state.ticks[kElbow] = ticks(i);
    watch.add(state);
    if (watch.at_rest()) return i * 10ms;
  }
  return {};
}

TEST(StillWatch, AnEncoderThatStandsIsAtRestAfterItsWindow) {
  EXPECT_EQ(first_rest([](int) { return -7; }), StillWatch::kWindow);
}

TEST(StillWatch, AnEncoderThatFlickersOverThreeTicksIsAtRestWhereverItBegins) {
  for (const int begin : {0, 1, 2})
    EXPECT_EQ(first_rest([begin](int i) { return (begin + 2 * i) % 3; }), StillWatch::kWindow) << begin;
}

TEST(StillWatch, AnEncoderThatCreepsOrFlickersOverFourIsNot) {
  EXPECT_FALSE(first_rest([](int i) { return i / 6; })) << "17 ticks/s";
  EXPECT_FALSE(first_rest([](int i) { return i % 4; }));
}

TEST(StillWatch, CountsFromTheEndOfTheMotion) {
  EXPECT_EQ(first_rest([](int i) { return std::min(i, 100); }), 990ms + StillWatch::kWindow);
}

TEST(StillWatch, IsNotAtRestAnyMoreOnceItMoves) {
  StillWatch watch;
  JointState state;
  for (int i = 0; i <= 30; ++i) {
    state.stamp = Stamp{} + i * 10ms;
    watch.add(state);
  }
  ASSERT_TRUE(watch.at_rest());
  state.ticks[kSlew] += 3;
  watch.add(state);
  EXPECT_FALSE(watch.at_rest());
}

}  // namespace
}  // namespace tankrig
