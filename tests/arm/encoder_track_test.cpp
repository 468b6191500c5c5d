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
  for (int raw = 65500; raw <= 65536 + 3000; raw += 25) ASSERT_EQ(sut.take(raw), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 2989);
  for (int raw = 65536 + 2989; raw >= 65536 - 3000; raw -= 25) ASSERT_EQ(sut.take(raw), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), -2986);
}

TEST(EncoderTrack, UnwrapsManyTurns) {
  Started sut(0);
  for (int ticks = 1; ticks <= 200'000; ticks += 35) ASSERT_EQ(sut.take(ticks), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 199'991);
}

TEST(EncoderTrack, RejectsZeroPeaksAndStaysAtWhatItLastBelieved) {
  Started sut(5000);
  for (int i = 1; i <= 10; ++i) ASSERT_EQ(sut.take(5000 + 10 * i), Reading::kGood);
  const Stamp read = sut.now;
  EXPECT_EQ(sut.take(0), Reading::kRejected);
  EXPECT_EQ(sut.track.ticks(), 5100);
  EXPECT_EQ(sut.track.when(), read) << "no place is said to be measured when it was not";
  EXPECT_EQ(sut.take(5120), Reading::kGood);
  EXPECT_EQ(sut.take(0), Reading::kRejected);
  EXPECT_EQ(sut.take(0), Reading::kRejected);
  EXPECT_EQ(sut.track.ticks(), 5120);
  EXPECT_EQ(sut.take(5150), Reading::kGood);
  EXPECT_EQ(sut.track.ticks(), 5150);
}

/// The sweep crosses the place where the encoder stood at power-up: every distance from 0 has its turn.
TEST(EncoderTrack, RejectsFalseZerosAtAnyDistanceFromZeroThatMatters) {
  for (const int step : {-13, -7, 0, 5, 11}) {
    for (int place = -900; place <= 900; place += 3) {
      if (std::abs(place + step) <= 3 || std::abs(place) <= 3)
        continue;  // what is believed there is 3 ticks wrong at most
      Started sut(static_cast<std::uint16_t>(place - 40 * step));
      for (int i = 39; i >= 0; --i) sut.take(place - i * step);
      ASSERT_EQ(sut.track.ticks(), place);
      ASSERT_EQ(sut.take(0), Reading::kRejected) << "at " << place << ", " << step << " a reading";
      ASSERT_EQ(sut.take(place + 2 * step), Reading::kGood) << "at " << place << ", " << step << " a reading";
    }
  }
}

TEST(EncoderTrack, BelievesAnAxisThatComesToStandAtZero) {
  for (const int speed : {20, 7, 1}) {
    Started sut(static_cast<std::uint16_t>(40 * speed));
    for (int raw = 39 * speed; raw > 0; raw -= speed) ASSERT_NE(sut.take(raw), Reading::kJumped);
    for (int i = 0; i < 10; ++i) ASSERT_NE(sut.take(0), Reading::kJumped) << speed << " a reading";
    EXPECT_EQ(sut.track.ticks(), 0) << speed;
    EXPECT_EQ(sut.take(0), Reading::kGood) << speed;
  }
}

/// At 100 readings a second from rest, against the stop and back: the emulated arm's lag of 30 ms and one that has
/// none.
TEST(EncoderTrack, BelievesEveryAxisThatCanBe) {
  for (const double lag : {0.03, 1e-6}) {
    Started sut(5000);
    double place = 5000, speed = 0;
    for (const double demand : {2000.0, -2000.0, 0.0, 2000.0, 0.0}) {
      for (int i = 0; i < 40; ++i) {
        for (int t = 0; t < 10; ++t) {
          speed += (demand - speed) * (1 - std::exp(-1e-3 / lag));
          place += speed * 1e-3;
        }
        ASSERT_EQ(sut.take(static_cast<int>(std::lround(place))), Reading::kGood) << "lag " << lag << ", " << demand;
      }
    }
  }
}

TEST(EncoderTrack, BelievesAJumpThatPersists) {
  Started sut(5000);
  EXPECT_EQ(sut.take(20), Reading::kRejected);
  EXPECT_EQ(sut.take(21), Reading::kRejected);
  EXPECT_EQ(sut.take(22), Reading::kJumped);
  EXPECT_EQ(sut.track.ticks(), 22);
  EXPECT_EQ(sut.take(23), Reading::kGood);
}

TEST(EncoderTrack, RejectsWhatIsFartherFromItsPredictionThanAnAxisGetsMeanwhile) {
  constexpr int kFarthest = 40 + 40;  // jump_ticks, and 4095 ticks/s for 10 ms
  for (const int way : {1, -1}) {
    EXPECT_EQ(Started(1000).take(1000 + way * kFarthest), Reading::kGood);
    EXPECT_EQ(Started(1000).take(1000 + way * (kFarthest + 1)), Reading::kRejected);
    Started moving(1000);  // 20 ticks a reading
    for (int i = 1; i <= 20; ++i) ASSERT_EQ(moving.take(1000 + way * 20 * i), Reading::kGood);
    Started same = moving;
    EXPECT_EQ(moving.take(1000 + way * (420 + kFarthest)), Reading::kGood);
    EXPECT_EQ(same.take(1000 + way * (420 + kFarthest + 1)), Reading::kRejected);
  }
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
    const int raw = random() % 3 == 0 ? static_cast<int>(random() & 0xFFFF) : before + static_cast<int>(random() % 30);
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
