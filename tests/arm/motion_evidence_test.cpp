// When an encoder that reads the same is no evidence of rest.
#include "drivers/arm/motion_evidence.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kLongest = 250ms, kStep = 10ms;
constexpr int kSpeed = 400;

/// The elbow, read every 10 ms.
struct EvidenceBench {
  MotionEvidence sut{kLongest};
  Stamp now{1'000'000'000};
  std::uint16_t raw = 5000;

  void demand(int speed) { sut.demand(kElbow, speed, now); }
  void standing(Duration time, bool stalled = false) {
    for (const Stamp end = now + time; now < end;) {
      now = now + kStep;
      sut.read(kElbow, raw, now, stalled);
    }
  }
  void moving(Duration time) {
    for (const Stamp end = now + time; now < end;) {
      raw = static_cast<std::uint16_t>(raw + 4);
      standing(kStep);
    }
  }
};

TEST(MotionEvidence, AnEncoderThatStandsIsFrozenOnlyWhileItIsDriven) {
  EvidenceBench bench;
  bench.standing(10s);
  EXPECT_FALSE(bench.sut.frozen());
  bench.demand(kSpeed);
  bench.standing(kLongest);
  EXPECT_FALSE(bench.sut.frozen());
  bench.standing(kStep);
  EXPECT_TRUE(bench.sut.frozen());
}

TEST(MotionEvidence, WhatIsFrozenStaysSoAtRestUntilItReadsSomethingElse) {
  EvidenceBench bench;
  bench.demand(kSpeed);
  bench.moving(1s);
  bench.standing(2 * kLongest);
  bench.demand(0);
  bench.standing(10s);
  EXPECT_TRUE(bench.sut.frozen());
  ++bench.raw;
  bench.standing(kStep);
  EXPECT_FALSE(bench.sut.frozen());
}

TEST(MotionEvidence, AStopInTheMiddleOfTheDoubtLeavesItFrozen) {
  EvidenceBench bench;
  bench.demand(kSpeed);
  bench.moving(1s);
  bench.standing(kLongest / 2 + kStep);
  EXPECT_FALSE(bench.sut.frozen());
  bench.demand(0);
  EXPECT_TRUE(bench.sut.frozen()) << "nothing says that it has come to rest";
}

TEST(MotionEvidence, AnArmThatMovedAndCameToRestIsBelieved) {
  EvidenceBench bench;
  bench.demand(kSpeed);
  bench.standing(80ms);  // its lag
  bench.moving(1s);
  bench.demand(0);
  bench.moving(40ms);
  bench.standing(10s);
  EXPECT_FALSE(bench.sut.frozen());
}

TEST(MotionEvidence, AnAxisAtItsStopIsNotFrozenWhileItDrawsItsStallCurrent) {
  EvidenceBench bench;
  bench.demand(kSpeed);
  bench.standing(10s, true);
  bench.demand(0);
  bench.standing(10s);
  EXPECT_FALSE(bench.sut.frozen());
}

TEST(MotionEvidence, SilenceIsNotStanding) {
  EvidenceBench bench;
  bench.demand(kSpeed);
  bench.moving(1s);
  bench.now = bench.now + 10s;
  bench.demand(0);
  EXPECT_FALSE(bench.sut.frozen());
  bench.now = bench.now + 10s;
  bench.demand(kSpeed);
  bench.standing(kLongest);
  EXPECT_FALSE(bench.sut.frozen()) << "it counts from the demand";
}

TEST(MotionEvidence, ADemandTooSlowToMoveAnythingAsksForNoMotion) {
  EvidenceBench bench;
  bench.demand(MotionEvidence::kDrivenTicks - 1);
  bench.standing(10s);
  EXPECT_FALSE(bench.sut.frozen());
}

TEST(MotionEvidence, AJointThatMovesSaysNothingOfAnother) {
  EvidenceBench bench;
  bench.sut.demand(kShoulder, kSpeed, bench.now);
  bench.demand(kSpeed);
  for (int i = 0; i < 100; ++i) {
    bench.sut.read(kShoulder, 77, bench.now, false);
    bench.moving(kStep);
  }
  EXPECT_TRUE(bench.sut.frozen());
}

}  // namespace
}  // namespace tankrig
