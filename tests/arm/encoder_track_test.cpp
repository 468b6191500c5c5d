#include "drivers/arm/encoder_track.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/arm_model.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using Reading = EncoderTrack::Reading;

constexpr Duration kPeriod = 10ms;

/// A track that has seen `raw` often enough, and the time after that.
struct Started {
  EncoderTrack track;
  Stamp now{};
  explicit Started(std::uint16_t raw) {
    for (int i = 0; i < 3; ++i) take(raw);
  }
  Reading take(int raw) {
    now = now + kPeriod;
    return track.take(static_cast<std::uint16_t>(raw), now);
  }
};

TEST(EncoderTrack, BelievesTheFirstReadingsOnlyWhenTheyAgree) {
  EncoderTrack sut;
  EXPECT_EQ(sut.take(0, {1}), Reading::kStarting);  // a false zero
  EXPECT_EQ(sut.take(5000, {2}), Reading::kStarting);
  EXPECT_EQ(sut.take(5010, {3}), Reading::kStarting);
  EXPECT_EQ(sut.take(5020, {4}), Reading::kGood);
  EXPECT_EQ(sut.ticks(), 5020);
}

TEST(EncoderTrack, CountsOnAcrossTheWrapBothWays) {
  Started sut(65500);
  EXPECT_EQ(sut.track.ticks(), -36);
  for (int raw = 65500; raw <= 65536 + 3000; raw += 500) EXPECT_EQ(sut.take(raw), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 65500 - 65536 + 3000);
  for (int raw = 3000; raw >= -3000; raw -= 500) EXPECT_EQ(sut.take(raw), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), -3036 + 36);
}

TEST(EncoderTrack, UnwrapsManyTurns) {
  Started sut(0);
  for (int ticks = 0; ticks <= 200'000; ticks += 700) ASSERT_EQ(sut.take(ticks), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 199'500);
}

TEST(EncoderTrack, RejectsZeroPeaksAndCarriesThePositionOn) {
  Started sut(5000);
  for (int i = 1; i <= 10; ++i) ASSERT_EQ(sut.take(5000 + 10 * i), Reading::kGood);
  EXPECT_EQ(sut.take(0), Reading::kRejected);
  EXPECT_EQ(sut.track.ticks(), 5110);
  EXPECT_EQ(sut.take(5120), Reading::kGood);
  EXPECT_EQ(sut.take(0), Reading::kRejected);
  EXPECT_EQ(sut.take(0), Reading::kRejected);
  EXPECT_EQ(sut.track.ticks(), 5140);
  EXPECT_EQ(sut.take(5150), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 5150);
}

TEST(EncoderTrack, BelievesAJumpThatPersists) {
  Started sut(5000);
  EXPECT_EQ(sut.take(20), Reading::kRejected);
  EXPECT_EQ(sut.take(21), Reading::kRejected);
  EXPECT_EQ(sut.take(22), Reading::kJumped);
  EXPECT_EQ(sut.track.ticks(), 22);
  EXPECT_EQ(sut.take(23), Reading::kGood);
}

TEST(EncoderTrack, RejectsAChangeOf801TicksAndTakes800) {
  EXPECT_EQ(Started(1000).take(1800), Reading::kGood);
  EXPECT_EQ(Started(1000).take(1801), Reading::kRejected);
  EXPECT_EQ(Started(1000).take(200), Reading::kGood);
  EXPECT_EQ(Started(1000).take(199), Reading::kRejected);
}

TEST(EncoderTrack, BelievesAfterAPauseWhatAnAxisCanDoMeanwhile) {
  Started sut(1000);
  sut.now = sut.now + 500ms;
  EXPECT_EQ(sut.take(2500), Reading::kGood);
}

TEST(EncoderTrack, MeasuresFromItsZeroAlsoAcrossTheWrap) {
  Started sut(300);
  sut.track.set_zero(65000);
  EXPECT_EQ(sut.track.ticks(), 836);
  EXPECT_EQ(sut.take(310), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 846);
  EncoderTrack again;  // the program started anew
  again.set_zero(65000);
  for (int i = 0; i < 3; ++i) again.take(310, {i});
  EXPECT_EQ(again.ticks(), 846);
}

TEST(EncoderTrack, MeasuresSpeedOverSeveralReadings) {
  Started sut(1000);
  for (int i = 1; i <= 20; ++i) sut.take(1000 + static_cast<int>(std::lround(3.37 * i)));
  EXPECT_NEAR(sut.track.speed(), 337, 25);
  for (int i = 0; i < 8; ++i) sut.take(1067);
  EXPECT_EQ(sut.track.speed(), 0);
}

TEST(EncoderTrack, TakesNoWaverByATickForSpeed) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  Started sut(1000);
  for (int i = 0; i < 1000; ++i) {
    sut.take(999 + static_cast<int>(random() % 3));
    ASSERT_EQ(sut.track.speed(), 0) << "reading " << i << ", seed " << kSeed;
  }
  for (const int way : {1, -1}) {  // nor after a motion, once the place is known
    for (int i = 0; i < 100; ++i) sut.take(sut.track.ticks() + 15 * way);
    const std::int32_t place = sut.track.ticks();
    for (int i = 0; i < 50; ++i) sut.take(place + 1 - i % 3);
    for (int i = 0; i < 100; ++i) {
      sut.take(place - 1 + static_cast<int>(random() % 3));
      ASSERT_EQ(sut.track.speed(), 0) << "reading " << i << " after moving, seed " << kSeed;
    }
  }
}

TEST(EncoderTrack, SeesSlowMotionOfAnAxisInEveryTick) {
  const Actuator elbow = arm5e().actuators[kElbow];
  const double speed = 0.02 / elbow.resolution(1.0);  // rad/s -> ticks/s
  Started sut(1000);
  int moved = 0;
  for (int i = 1; i <= 200; ++i) {
    sut.take(1000 + static_cast<int>(std::lround(i * seconds(kPeriod) * speed)));
    if (i < 10) continue;
    ASSERT_GT(sut.track.speed() * elbow.resolution(1.0), 0.01) << "reading " << i << ": slower than rest";
    ++moved;
  }
  EXPECT_GT(moved, 100);
}

TEST(EncoderTrack, NeverJumpsFartherThanBelievedOnRandomInput) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  Started sut(0);
  std::int32_t before = 0;
  for (int i = 0; i < 100'000; ++i) {
    const int raw = random() % 3 == 0 ? static_cast<int>(random() & 0xFFFF) : before + static_cast<int>(random() % 100);
    const Reading reading = sut.take(raw);
    if (reading == Reading::kGood) {
      ASSERT_LE(std::abs(sut.track.ticks() - before), 2000) << "seed " << kSeed;
    }
    before = sut.track.ticks();
    ASSERT_TRUE(std::isfinite(sut.track.speed()));
  }
}

}  // namespace
}  // namespace tankrig
