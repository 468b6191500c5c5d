#include "sim_backends/wire/box_logic.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

/// A box whose contactors follow their coil at once, unless they are welded.
struct Box {
  BoxLogic logic;
  Stamp now{1'000'000'000};
  bool contact = false, welded = false;

  void pass(Duration time, bool pressed = false) {
    for (const Stamp end = now + time; now < end; now = now + 1ms) {
      logic.button(pressed, now);
      if (!welded) contact = logic.coil();
      logic.tick(contact, now);
    }
  }
  void beat(int times, Duration apart = 20ms, bool pressed = false) {
    for (int i = 0; i < times; ++i) {
      logic.edge(now);
      pass(apart, pressed);
    }
  }
  void enable() {
    beat(12);
    beat(2, 20ms, true);
    beat(2);
  }
};

TEST(BoxLogic, ClosesWhenItsButtonIsPressedAfterGoodBeats) {
  Box box;
  box.beat(BoxLogic::kEdgesForReset);
  EXPECT_FALSE(box.contact) << "nobody has pressed";
  box.beat(1, 20ms, true);
  EXPECT_TRUE(box.contact);
}

TEST(BoxLogic, DoesNothingForAButtonThatIsPressedAtPowerUpOrTooSoon) {
  Box held;
  held.beat(50, 20ms, true);
  EXPECT_FALSE(held.contact);
  Box early;
  early.beat(BoxLogic::kEdgesForReset - 2);
  early.beat(50, 20ms, true);
  EXPECT_FALSE(early.contact);
}

TEST(BoxLogic, OpensWithinItsTimeAfterTheLastEdgeAndStaysOpenUntilTheButton) {
  Box box;
  box.enable();
  ASSERT_TRUE(box.contact);
  const Stamp last = box.now - 20ms;
  while (box.contact) box.pass(1ms);
  EXPECT_LE(box.now - last, BoxLogic::kLongestGap + 4ms);
  EXPECT_GE(box.now - last, BoxLogic::kLongestGap);
  box.beat(50);
  EXPECT_FALSE(box.contact);
  box.beat(1, 20ms, true);
  EXPECT_TRUE(box.contact);
}

/// A program whose edges are late by up to 15 ms and now and then by 45 ms, commands of an hour, pauses of a second
/// between them; the box is late to look by up to 5 ms.
TEST(BoxLogic, OpensInADayOnlyWhereACommandEnds) {
  const std::uint64_t seed = 15;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937_64 random(seed);
  const auto up_to = [&random](Duration most) {
    return Duration{static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(most.count()))};
  };
  constexpr Duration kDay = 24h, kCommand = 1h, kPause = 1s;
  const Stamp begin{1'000'000'000};
  Stamp edge = begin, look = begin, command = begin;
  BoxLogic logic;
  bool closed = false;
  int ended = 0, opened = 0;
  std::uint64_t edges = 0;
  while (look - begin < kDay) {
    if (edge <= look) {
      logic.edge(edge);
      edge = edge + 20ms + (++edges % 10'000 == 0 ? Duration{45ms} : up_to(15ms));
      if (edge - command > kCommand) {
        ++ended;
        command = edge = edge + kPause;
      }
      continue;
    }
    logic.button(logic.ready() && !closed, look);
    logic.tick(closed, look);
    opened += closed && !logic.coil();
    closed = logic.coil();
    look = look + 2ms + up_to(5ms);
  }
  EXPECT_EQ(opened, ended) << "seed " << seed;
  EXPECT_GT(ended, 20);
  EXPECT_GT(edges, 2'000'000U);
  EXPECT_FALSE(logic.stuck());
}

TEST(BoxLogic, OpensOnAnOscillation) {
  Box box;
  box.enable();
  ASSERT_TRUE(box.contact);
  box.beat(2, 1ms);
  EXPECT_FALSE(box.contact);
  box.beat(500, 1ms);
  EXPECT_FALSE(box.logic.ready()) << "edges, but no heartbeat";
}

TEST(BoxLogic, TakesNumberedFramesThatComeAtOnce) {
  Box box;
  box.enable();
  for (int i = 0; i < 20; ++i) {
    for (int at_once = 0; at_once < 3; ++at_once) box.logic.edge(box.now, true);
    box.pass(60ms);
  }
  EXPECT_TRUE(box.contact);
}

TEST(BoxLogic, RefusesToResetOnceAContactorDoesNotFollow) {
  Box box;
  box.enable();
  box.welded = true;
  box.pass(500ms);
  EXPECT_TRUE(box.contact) << "welded";
  EXPECT_TRUE(box.logic.stuck());
  EXPECT_FALSE(box.logic.coil());
  box.welded = false;
  box.enable();
  EXPECT_FALSE(box.logic.coil()) << "until it is repaired";
}

TEST(BoxLogic, IsStuckFromPowerUpWhereAContactIsClosed) {
  Box box;
  box.welded = box.contact = true;
  box.enable();
  EXPECT_TRUE(box.logic.stuck());
  EXPECT_FALSE(box.logic.coil());
}

}  // namespace
}  // namespace tankrig::sim
