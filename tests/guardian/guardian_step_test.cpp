// The guardian's step against the table above it, and a day of operation without a false alarm.
#include "rig/guardian/guardian_step.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPatience = 60ms;

/// The rows, as written there; each bit of `bits` is one column.
GuardianAct by_table(bool taken_over, bool gone, bool watched, bool stalled, bool settled, bool& then) {
  then = taken_over || (watched && (gone || stalled));
  if (taken_over && gone && settled) return GuardianAct::kEnd;
  if (taken_over) return GuardianAct::kMakeSafe;
  if (gone && watched) return GuardianAct::kMakeSafe;
  if (gone) return GuardianAct::kEnd;
  if (watched && stalled) return GuardianAct::kMakeSafe;
  return GuardianAct::kWatch;
}

TEST(GuardianStep, FollowsItsTable) {
  for (unsigned bits = 0; bits < 1U << 8; ++bits) {
    const auto bit = [bits](unsigned n) { return (bits >> n & 1U) != 0; };
    const bool taken_over = bit(0), gone = bit(1), watched = bit(2), watched_before = bit(3), stands = bit(4);
    const bool confirmed = bit(5), acknowledged = bit(6), stalled_before = bit(7);
    GuardianState state{taken_over, watched_before, 7, Stamp{1'000'000'000}, stalled_before ? kPatience : Duration{0}};
    const GuardianInputs in{state.looked + 5ms, stands ? 7U : 8U, watched, gone, confirmed, acknowledged, kPatience};
    const bool stalled = watched && watched_before && stands && stalled_before;
    bool then = false;
    const GuardianAct act = by_table(taken_over, gone, watched, stalled, confirmed || acknowledged, then);
    const GuardianStep next = step(state, in);
    EXPECT_EQ(next.act, act) << "case " << bits;
    EXPECT_EQ(next.state.taken_over, then) << "case " << bits;
  }
}

TEST(GuardianStep, TakesOverOnceTheStepsStandStillForLongerThanItsPatience) {
  GuardianState state;
  Stamp now{1'000'000'000};
  std::uint64_t steps = 0;
  for (int i = 0; i < 100; ++i, now = now + 5ms) {
    const GuardianStep next = step(state, {now, ++steps, true, false, false, false, kPatience});
    ASSERT_EQ(next.act, GuardianAct::kWatch);
    state = next.state;
  }
  const Stamp last = now - 5ms;
  while (!state.taken_over) {
    state = step(state, {now, steps, true, false, false, false, kPatience}).state;
    now = now + 5ms;
    ASSERT_LT(now - last, 100ms);
  }
  EXPECT_GT(now - last, kPatience);
}

/// A host that takes the guardian's processor away, be it for seconds, shows nothing of the program.
TEST(GuardianStep, CountsNoTimeInWhichItDidNotLook) {
  GuardianState state;
  Stamp now{1'000'000'000};
  for (std::uint64_t steps = 1; steps < 4; ++steps, now = now + 10s) {
    const GuardianStep next = step(state, {now, 1, true, false, false, false, kPatience});
    EXPECT_EQ(next.act, GuardianAct::kWatch);
    state = next.state;
  }
  EXPECT_LE(state.stalled, 2 * kLongestLook);
}

/// A program at 200 Hz with wake-ups late by up to three periods and now and then by 50 ms, commands of an hour, pauses
/// of a second between them; its guardian is late alike.
TEST(GuardianStep, RaisesNoFalseAlarmInADay) {
  const std::uint64_t seed = 15;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937_64 random(seed);
  const auto late = [&random]() -> Duration {
    const std::uint64_t r = random();
    if (r % 20'000 == 0) return 45ms;
    return Duration{static_cast<std::int64_t>((r >> 20) % 15'000'000)};
  };
  constexpr Duration kCycle = 5ms, kDay = 24h, kCommand = 1h, kPause = 1s;
  const Stamp begin{0};
  Stamp program = begin, guardian = begin, command = begin;
  GuardianState state;
  std::uint64_t steps = 0, rounds = 0;
  bool watched = false;
  while (guardian - begin < kDay) {
    if (program <= guardian) {
      ++steps;
      watched = true;
      program = program + kCycle + late();
      if (program - command > kCommand) {  // an orderly end: released with its last step, the next begins later
        watched = false;
        command = program = program + kPause;
      }
      continue;
    }
    const GuardianStep next = step(state, {guardian, steps, watched, false, false, false, kPatience});
    ASSERT_EQ(next.act, GuardianAct::kWatch) << "after " << seconds(guardian - begin) << " s, seed " << seed;
    state = next.state;
    guardian = guardian + kCycle + late();
    ++rounds;
  }
  EXPECT_GT(steps, 5'000'000U);
  EXPECT_GT(rounds, 5'000'000U);
}

}  // namespace
}  // namespace tankrig
