#include "sim_backends/wire/box_logic.hpp"

#include <gtest/gtest.h>

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
