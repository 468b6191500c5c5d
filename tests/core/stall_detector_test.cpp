// What counts as silence: only what the watcher was there to see.
#include "core/stall_detector.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kLongestLook = 50ms;

Stamp at(Duration time) { return Stamp{} + time; }

TEST(StallDetector, AddsUpFromLookToLookAndEndsWithARound) {
  StallDetector silence(kLongestLook);
  for (const Duration now : {10ms, 20ms, 45ms}) silence.look(at(now), 0);
  EXPECT_EQ(silence.stalled_for(), 45ms);
  silence.look(at(60ms), 1);
  EXPECT_EQ(silence.stalled_for(), 0ms);
  silence.look(at(70ms), 1);
  EXPECT_EQ(silence.stalled_for(), 10ms);
}

TEST(StallDetector, DoesNotCountTheTimeInWhichTheWatcherWasAway) {
  StallDetector silence(kLongestLook);
  silence.look(at(10ms), 0);
  silence.look(at(1h), 0);
  EXPECT_EQ(silence.stalled_for(), 10ms + kLongestLook);
}

TEST(StallDetector, BeginsAnewWhereItIsRestarted) {
  StallDetector silence(kLongestLook, at(1s));
  silence.look(at(1s + 20ms), 7);
  silence.look(at(1s + 40ms), 7);
  EXPECT_EQ(silence.stalled_for(), 20ms);
  silence.restart(at(2s));
  silence.look(at(2s + 30ms), 0);
  EXPECT_EQ(silence.stalled_for(), 30ms);
}

}  // namespace
}  // namespace tankrig
