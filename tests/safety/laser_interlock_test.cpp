#include "rig/safety/laser_interlock.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "tests/safety/truth_table.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::TruthTable;

constexpr InterlockLimits kLimits{1s, 20s, 10s};
constexpr Stamp kNow{1'000'000'000'000};

struct Case {
  InterlockState state;
  InterlockInputs in;
};

bool fault(const InterlockInputs& in) { return in.device_fault || in.beam != BeamVerdict::kNone; }
bool trouble(const InterlockInputs& in) { return in.slept || fault(in); }
bool lines(const InterlockInputs& in) { return in.interlock_closed && in.heartbeat_fresh && in.enabled; }
bool cut(const Case& c) { return !c.in.enabled && (c.state.last_enabled || c.state.armed || c.in.homing); }

/// Calls `check` for every state and every input: all booleans, every verdict, and of every timer a value on either
/// side of its limit and on it.
template <class Check>
void for_every_case(Check check) {
  const std::array<Duration, 3> armed_for{1s - 1ns, 1s, 100s}, held_for{10s - 1ns, 10s, 0s},
      lit_for{20s, 20s + 1ns, 0s};
  const std::array<Duration, 2> dark_for{1s - 1ns, 1s};
  Case c;
  for (unsigned s = 0; s < 128; ++s)
    for (unsigned timers = 0; timers < 3 * 3 * 3 * 2; ++timers)
      for (unsigned i = 0; i < 2048; ++i)
        for (const BeamVerdict beam : {BeamVerdict::kNone, BeamVerdict::kMissing, BeamVerdict::kStray}) {
          const auto bit = [](unsigned bits, int n) { return ((bits >> n) & 1) != 0; };
          c.state = {bit(s, 0),
                     bit(s, 1),
                     bit(s, 2),
                     bit(s, 3),
                     bit(s, 4),
                     bit(s, 5),
                     bit(s, 6),
                     kNow - armed_for[timers % 3],
                     kNow - held_for[timers / 3 % 3],
                     kNow - lit_for[timers / 9 % 3],
                     kNow - dark_for[timers / 27]};
          c.in = {kNow,      bit(i, 0), bit(i, 1), bit(i, 2), bit(i, 3),  bit(i, 4), bit(i, 5),
                  bit(i, 6), bit(i, 7), bit(i, 8), bit(i, 9), bit(i, 10), beam};
          check(c, step(c.state, c.in, kLimits));
        }
}

/// Counts the cases where a law is broken; the first one is shown.
struct Law {
  const char* name;
  std::function<bool(const Case&, const InterlockStep&)> holds;
  std::uint64_t broken = 0;
  std::string first{};
};

std::string shown(const Case& c) {
  const auto& s = c.state;
  const auto& i = c.in;
  std::string text = "state armed latched holding last_arm last_hold last_enabled stretch:";
  for (const bool b : {s.armed, s.latched, s.holding, s.last_arm, s.last_hold, s.last_enabled, s.stretch})
    text += b ? " 1" : " 0";
  text += "; input arm hold interlock heartbeat rest sweeping fault slept request enabled homing:";
  for (const bool b : {i.arm, i.hold, i.interlock_closed, i.heartbeat_fresh, i.at_rest, i.sweeping, i.device_fault,
                       i.slept, i.laser_request, i.enabled, i.homing})
    text += b ? " 1" : " 0";
  return text + "; beam " + std::to_string(static_cast<int>(i.beam));
}

void expect_laws(std::vector<Law> laws) {
  std::uint64_t cases = 0;
  for_every_case([&](const Case& c, const InterlockStep& out) {
    ++cases;
    for (Law& law : laws)
      if (!law.holds(c, out) && law.broken++ == 0) law.first = shown(c);
  });
  for (const Law& law : laws)
    EXPECT_EQ(law.broken, 0u) << law.name << ": broken in " << law.broken << " of " << cases << " cases, first "
                              << law.first;
  EXPECT_EQ(cases, 128u * 54 * 2048 * 3);
}

TEST(LaserInterlock, DoesInEveryCaseWhatTheTableAboveItSays) {
  const TruthTable table = TruthTable::in_file(TANKRIG_SOURCE_DIR "/rig/safety/laser_interlock.hpp");
  ASSERT_EQ(table.rows(), 15u);
  std::vector<std::uint64_t> used(table.rows());
  std::uint64_t wrong = 0;
  std::string first;
  const std::size_t latched = table.input("latched"), armed = table.input("armed"), holding = table.input("holding"),
                    arm = table.input("arm"), hold = table.input("hold"), homing = table.input("homing"),
                    cut_column = table.input("cut"), slept = table.input("slept"), fault_column = table.input("fault"),
                    lines_column = table.input("lines"), over = table.input("over"), rest = table.input("rest"),
                    sweeping = table.input("sweeping"), time = table.input("time");
  std::vector<TruthTable::Value> values(table.inputs());
  for_every_case([&](const Case& c, const InterlockStep& out) {
    const bool stretch = c.state.stretch && c.in.now - c.state.last_lit < kLimits.indicator_delay;
    const bool asks = c.in.laser_request && (c.in.sweeping || c.state.holding);
    values[latched] = {c.state.latched, false};
    values[armed] = {c.state.armed, false};
    values[holding] = {c.state.holding, false};
    values[arm] = {c.in.arm, c.in.arm && !c.state.last_arm};
    values[hold] = {c.in.hold, c.in.hold && !c.state.last_hold};
    values[homing] = {c.in.homing, false};
    values[cut_column] = {cut(c), false};
    values[slept] = {c.in.slept, false};
    values[fault_column] = {fault(c.in), false};
    values[lines_column] = {lines(c.in), false};
    values[over] = {asks && stretch && c.in.now - c.state.lit_at > kLimits.maximum_on, false};
    values[rest] = {c.in.at_rest, false};
    values[sweeping] = {c.in.sweeping, false};
    values[time] = {c.in.now - c.state.held_at < kLimits.hold, false};
    const std::size_t row = table.row_of(values);
    ASSERT_LT(row, table.rows());
    ++used[row];
    const auto& expected = table.outcome(row);
    if (out.state.latched != expected[0] || out.state.armed != expected[1] || out.state.holding != expected[2])
      if (wrong++ == 0) first = "row " + std::to_string(row + 1) + ", " + shown(c);
  });
  EXPECT_EQ(wrong, 0u) << first;
  for (std::size_t row = 0; row < used.size(); ++row) EXPECT_GT(used[row], 0u) << "row " << row + 1 << " never applies";
}

TEST(LaserInterlock, KeepsItsLawsInEveryCase) {
  expect_laws({
      {"light needs every condition",
       [](const Case& c, const InterlockStep& out) {
         if (!out.outputs.laser) return true;
         const bool armed = c.state.armed && c.in.arm && c.in.now - c.state.armed_at >= kLimits.indicator_delay;
         const bool within = !c.state.stretch || c.in.now - c.state.last_lit >= kLimits.indicator_delay ||
                             c.in.now - c.state.lit_at <= kLimits.maximum_on;
         const bool held = c.in.at_rest && c.in.hold &&
                           (c.state.holding ? c.in.now - c.state.held_at < kLimits.hold : !c.state.last_hold);
         return armed && lines(c.in) && !trouble(c.in) && !c.state.latched && c.in.laser_request &&
                (c.in.sweeping || held) && within;
       }},
      {"light in a sweep where every condition holds",
       [](const Case& c, const InterlockStep& out) {
         const bool all = !c.state.latched && c.state.armed && c.in.arm && lines(c.in) && !trouble(c.in) &&
                          c.in.sweeping && c.in.laser_request && !c.state.holding && !c.state.stretch &&
                          c.in.now - c.state.armed_at >= kLimits.indicator_delay;
         return !all || out.outputs.laser;
       }},
      {"becomes armed only by an edge outside any fault, and never with light in the same step",
       [](const Case& c, const InterlockStep& out) {
         if (!out.state.armed || c.state.armed) return true;
         return c.in.arm && !c.state.last_arm && !c.state.latched && lines(c.in) && !trouble(c.in) &&
                out.state.armed_at == kNow && !out.outputs.laser;
       }},
      {"a hold begins only by an edge, armed, at rest, outside a sweep",
       [](const Case& c, const InterlockStep& out) {
         if (!out.state.holding || c.state.holding) return true;
         return c.in.hold && !c.state.last_hold && c.state.armed && c.in.at_rest && !c.in.sweeping &&
                out.state.held_at == kNow;
       }},
      {"no motion in a hold, none while latched, none without the box, motion otherwise",
       [](const Case& c, const InterlockStep& out) {
         return out.outputs.motion == (!out.state.latched && !out.state.holding && c.in.enabled);
       }},
      {"homing only where asked for, in the dark, with every line good, and where motion is allowed",
       [](const Case& c, const InterlockStep& out) {
         return out.outputs.homing == (out.outputs.motion && c.in.homing && !out.state.armed && lines(c.in));
       }},
      {"neither homing nor light where the other may be",
       [](const Case&, const InterlockStep& out) { return !out.outputs.homing || !out.outputs.laser; }},
      {"every fault latches",
       [](const Case& c, const InterlockStep& out) {
         return c.state.latched || !(trouble(c.in) || cut(c)) || (out.state.latched && out.outputs.trip != Trip::kNone);
       }},
      {"latched for good",
       [](const Case& c, const InterlockStep& out) { return !c.state.latched || out.state.latched; }},
      {"neither light, motion, arming nor hold while latched",
       [](const Case&, const InterlockStep& out) {
         return !out.state.latched ||
                (!out.outputs.laser && !out.outputs.motion && !out.state.armed && !out.state.holding);
       }},
      {"tells the very step that trips, and why",
       [](const Case& c, const InterlockStep& out) {
         const bool tripped = out.state.latched && !c.state.latched;
         if (tripped != (out.outputs.trip != Trip::kNone)) return false;
         switch (out.outputs.trip) {
           case Trip::kNone:
             return true;
           case Trip::kSlept:
             return c.in.slept;
           case Trip::kDevice:
             return c.in.device_fault;
           case Trip::kBeam:
             return c.in.beam != BeamVerdict::kNone;
           case Trip::kHeartbeat:
             return (c.state.armed || c.in.homing) && !c.in.heartbeat_fresh;
           case Trip::kInterlock:
             return (c.state.armed || c.in.homing) && !c.in.interlock_closed;
           case Trip::kDisabled:
             return cut(c);
           case Trip::kMaximumOn:
             return c.state.armed && c.in.now - c.state.lit_at > kLimits.maximum_on;
           case Trip::kMotion:
             return c.state.armed && c.state.holding && !c.in.at_rest;
         }
         return false;
       }},
      {"a stretch of light keeps its beginning",
       [](const Case& c, const InterlockStep& out) {
         const bool goes_on = c.state.stretch && c.in.now - c.state.last_lit < kLimits.indicator_delay;
         if (goes_on) return out.state.stretch && out.state.lit_at == c.state.lit_at;
         return out.state.stretch == out.outputs.laser && (!out.outputs.laser || out.state.lit_at == kNow);
       }},
      {"remembers the switches for the next edge",
       [](const Case& c, const InterlockStep& out) {
         return out.state.last_arm == c.in.arm && out.state.last_hold == c.in.hold &&
                out.state.last_enabled == c.in.enabled;
       }},
  });
}

/// The step, driven every 10 ms with everything well.
struct Driven {
  InterlockState state;
  InterlockInputs in;
  InterlockOutputs out;
  Driven() {
    in.interlock_closed = in.heartbeat_fresh = in.laser_request = true;
    run();
  }
  void run(Duration duration = 10ms) {
    for (const Stamp end = in.now + duration; in.now < end;) {
      in.now = in.now + 10ms;
      const InterlockStep next = step(state, in, kLimits);
      state = next.state;
      out = next.outputs;
    }
  }
  /// Runs until `what` is so; how long that took.
  Duration until(const std::function<bool()>& what) {
    const Stamp begin = in.now;
    while (!what() && in.now - begin < 100s) run();
    return in.now - begin;
  }
  void arm() {
    in.arm = false;
    run();
    in.arm = true;
    run();
  }
};

TEST(LaserInterlock, IsOffAtPowerUpEvenWithEverySwitchClosed) {
  Driven sut;
  sut.state = {};
  sut.in.arm = sut.in.hold = sut.in.sweeping = sut.in.at_rest = true;
  EXPECT_EQ(sut.until([&] { return sut.out.laser; }), 100s);
}

TEST(LaserInterlock, ShinesTheIndicatorsDelayAfterItIsArmed) {
  Driven sut;
  sut.in.sweeping = true;
  sut.arm();
  EXPECT_EQ(sut.until([&] { return sut.out.laser; }), 1s);
}

TEST(LaserInterlock, TripsWhenLightIsAskedForBeyondItsMaximum) {
  Driven sut;
  sut.in.sweeping = true;
  sut.arm();
  sut.until([&] { return sut.out.laser; });
  EXPECT_EQ(sut.until([&] { return !sut.out.laser; }), 20s + 10ms);
  EXPECT_EQ(sut.out.trip, Trip::kMaximumOn);
}

TEST(LaserInterlock, CountsShortDarkPausesAsPartOfTheStretch) {
  Driven sut;
  sut.in.sweeping = true;
  sut.arm();
  sut.until([&] { return sut.out.laser; });
  const Stamp begin = sut.in.now;
  for (int i = 0; sut.out.trip == Trip::kNone && sut.in.now - begin < 60s; ++i) {
    sut.in.laser_request = i / 4 % 2 == 0;
    sut.run();
  }
  EXPECT_EQ(sut.out.trip, Trip::kMaximumOn);
  EXPECT_NEAR(seconds(sut.in.now - begin), 20, 0.1);
}

TEST(LaserInterlock, StartsANewStretchAfterADarkPause) {
  Driven sut;
  sut.in.sweeping = true;
  sut.arm();
  sut.until([&] { return sut.out.laser; });
  sut.run(19s);
  sut.in.laser_request = false;
  sut.run(1s);
  sut.in.laser_request = true;
  sut.run(19s);
  EXPECT_TRUE(sut.out.laser);
}

TEST(LaserInterlock, HoldsLightAtRestForItsTimeAndNoLonger) {
  Driven sut;
  sut.in.at_rest = true;
  sut.arm();
  sut.run(2s);
  EXPECT_FALSE(sut.out.laser) << "nobody asked for a hold";
  sut.in.hold = true;
  sut.run();
  EXPECT_TRUE(sut.out.laser);
  EXPECT_FALSE(sut.out.motion);
  EXPECT_EQ(sut.until([&] { return !sut.out.laser; }), 10s);
  EXPECT_EQ(sut.out.trip, Trip::kNone) << "the end of its time is no fault";
  sut.run(20s);
  EXPECT_FALSE(sut.out.laser) << "a request still there is no edge";
  sut.in.hold = false;
  sut.run();
  sut.in.hold = true;
  sut.run();
  EXPECT_TRUE(sut.out.laser);
}

TEST(LaserInterlock, TripsWhenTheArmMovesInAHold) {
  Driven sut;
  sut.in.at_rest = true;
  sut.arm();
  sut.in.hold = true;
  sut.run(2s);
  ASSERT_TRUE(sut.out.laser);
  sut.in.at_rest = false;
  sut.run();
  EXPECT_FALSE(sut.out.laser);
  EXPECT_EQ(sut.out.trip, Trip::kMotion);
}

TEST(LaserInterlock, DropsBeamWhenHeartbeatIsLateAndStaysDark) {
  Driven sut;
  sut.in.sweeping = true;
  sut.arm();
  sut.run(2s);
  ASSERT_TRUE(sut.out.laser);
  sut.in.heartbeat_fresh = false;
  sut.run();
  EXPECT_FALSE(sut.out.laser);
  EXPECT_EQ(sut.out.trip, Trip::kHeartbeat);
  sut.in.heartbeat_fresh = true;
  sut.run(5s);
  EXPECT_FALSE(sut.out.laser || sut.out.motion) << "it came back by itself";
  sut.arm();
  sut.run(5s);
  EXPECT_FALSE(sut.out.laser || sut.out.motion) << "armed again after a fault";
}

}  // namespace
}  // namespace tankrig
