#include "rig/safety/laser_interlock.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

InterlockState state_of(unsigned bits) { return {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0}; }

InterlockInputs inputs_of(unsigned bits) {
  return {(bits & 1) != 0,  (bits & 2) != 0,  (bits & 4) != 0, (bits & 8) != 0,
          (bits & 16) != 0, (bits & 32) != 0, (bits & 64) != 0};
}

/// Calls `check(state, inputs, result)` for every one of the 2^4 x 2^7 cases.
template <class Check>
void for_every_case(Check check) {
  for (unsigned s = 0; s < 16; ++s)
    for (unsigned i = 0; i < 128; ++i) {
      SCOPED_TRACE("state " + std::to_string(s) + ", inputs " + std::to_string(i));
      check(state_of(s), inputs_of(i), step(state_of(s), inputs_of(i)));
    }
}

bool good(const InterlockInputs& in) { return in.interlock_closed && in.heartbeat_fresh && !in.device_fault; }

InterlockInputs ready() {
  InterlockInputs in;
  in.interlock_closed = in.heartbeat_fresh = in.sweeping = in.laser_request = true;
  return in;
}

/// An interlock that has been armed by a clean edge.
InterlockState armed() {
  InterlockInputs in = ready();
  InterlockState state = step(InterlockState{}, in).state;
  in.arm = true;
  return step(state, in).state;
}

TEST(LaserInterlock, ShinesOnlyIfEveryConditionHolds) {
  for_every_case([](const InterlockState& s, const InterlockInputs& in, const InterlockStep& out) {
    const bool was_or_becomes_armed = (s.armed && in.arm) || (!s.armed && in.arm && !s.last_arm);
    const bool expected = !s.latched && was_or_becomes_armed && in.interlock_closed && in.heartbeat_fresh &&
                          !in.device_fault && in.sweeping && in.laser_request;
    EXPECT_EQ(out.outputs.laser, expected);
  });
}

TEST(LaserInterlock, LatchesEveryFaultAndStaysLatchedUntilAResetEdgeWithAllGood) {
  for_every_case([](const InterlockState& s, const InterlockInputs& in, const InterlockStep& out) {
    if (s.latched)
      EXPECT_EQ(out.state.latched, !(in.reset && !s.last_reset && good(in)));
    else
      EXPECT_EQ(out.state.latched, in.device_fault || (s.armed && !good(in)));
  });
}

TEST(LaserInterlock, NeverMovesOrShinesWhileLatched) {
  for_every_case([](const InterlockState&, const InterlockInputs&, const InterlockStep& out) {
    EXPECT_EQ(out.outputs.motion, !out.state.latched);
    if (out.state.latched) {
      EXPECT_FALSE(out.outputs.laser);
      EXPECT_FALSE(out.state.armed);
    }
  });
}

TEST(LaserInterlock, TellsTheVeryStepThatTrips) {
  for_every_case([](const InterlockState& s, const InterlockInputs&, const InterlockStep& out) {
    EXPECT_EQ(out.outputs.tripped, out.state.latched && !s.latched);
  });
}

TEST(LaserInterlock, BecomesArmedOnlyByAnEdgeOutsideAnyFault) {
  for_every_case([](const InterlockState& s, const InterlockInputs& in, const InterlockStep& out) {
    if (out.state.armed && !s.armed) {
      EXPECT_TRUE(in.arm && !s.last_arm);
      EXPECT_FALSE(s.latched);
      EXPECT_TRUE(good(in));
    }
  });
}

TEST(LaserInterlock, IsOffAtPowerUpEvenWithTheSwitchClosed) {
  InterlockInputs in = ready();
  in.arm = true;
  InterlockStep out = step(InterlockState{}, in);
  EXPECT_FALSE(out.outputs.laser);
  out = step(out.state, in);
  EXPECT_FALSE(out.outputs.laser);
}

TEST(LaserInterlock, DropsBeamWhenHeartbeatIsLate) {
  InterlockInputs in = ready();
  in.arm = true;
  InterlockStep out = step(armed(), in);
  ASSERT_TRUE(out.outputs.laser);
  in.heartbeat_fresh = false;
  out = step(out.state, in);
  EXPECT_FALSE(out.outputs.laser);
  EXPECT_TRUE(out.outputs.tripped);
  in.heartbeat_fresh = true;
  out = step(out.state, in);
  EXPECT_FALSE(out.outputs.laser) << "the beam came back by itself";
}

TEST(LaserInterlock, NeedsResetThenArmingAgainAfterAFault) {
  InterlockInputs in = ready();
  in.arm = true;
  in.device_fault = true;
  InterlockStep out = step(armed(), in);
  in.device_fault = false;
  in.reset = true;
  out = step(step(out.state, ready()).state, in);
  EXPECT_FALSE(out.state.latched);
  in.reset = false;
  EXPECT_FALSE(step(out.state, in).outputs.laser) << "a switch still closed is no edge";
  in.arm = false;
  out = step(out.state, in);
  in.arm = true;
  EXPECT_TRUE(step(out.state, in).outputs.laser);
}

}  // namespace
}  // namespace tankrig
