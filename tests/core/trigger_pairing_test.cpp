#include "core/trigger_pairing.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "drivers/camera/camera.hpp"

namespace tankrig {
namespace {

Frame frame(std::uint64_t number, double t_ms) {
  Frame f;
  f.sequence = number;
  f.stamp = Stamp{} + from_seconds(t_ms * 1e-3);
  return f;
}

std::vector<FramePair<Frame>> all(TriggerPairing<Frame>& pairing) {
  std::vector<FramePair<Frame>> pairs;
  while (auto pair = pairing.next()) pairs.push_back(std::move(*pair));
  return pairs;
}

std::uint64_t singles(const TriggerPairingCounts& c) {
  return c.before_first_pair + c.partner_lost + c.off_time + c.partner_missed + c.partner_silent;
}

TEST(TriggerPairing, PairsFramesOfOneTriggerWhateverTheirNumbersBeginWith) {
  TriggerPairing<Frame> sut;
  for (std::uint64_t i = 0; i < 5; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    sut.add_right(frame(100 + i, 40.0 * static_cast<double>(i) + 0.7));
  }
  const std::vector<FramePair<Frame>> pairs = all(sut);
  ASSERT_EQ(pairs.size(), 5u);
  for (const FramePair<Frame>& p : pairs) {
    EXPECT_EQ(p.right.sequence, p.left.sequence + 100);
    EXPECT_EQ(p.apart, from_seconds(-0.7e-3));
  }
  EXPECT_EQ(singles(sut.counts()), 0u);
}

TEST(TriggerPairing, CountsAFrameWhosePartnerWasLostOnTheWay) {
  TriggerPairing<Frame> sut;
  for (std::uint64_t i = 0; i < 6; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    if (i != 3) sut.add_right(frame(i, 40.0 * static_cast<double>(i)));
  }
  EXPECT_EQ(all(sut).size(), 5u);
  EXPECT_EQ(sut.counts().partner_lost, 1u);
  EXPECT_EQ(singles(sut.counts()), 1u);
  EXPECT_EQ(sut.counts().renumbered, 0u);
}

TEST(TriggerPairing, FindsItsWayAfterACameraMissedATrigger) {
  TriggerPairing<Frame> sut;
  for (std::uint64_t i = 0; i < 8; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    if (i != 3) sut.add_right(frame(i < 3 ? i : i - 1, 40.0 * static_cast<double>(i)));  // no gap in its numbers
  }
  EXPECT_EQ(all(sut).size(), 7u);
  EXPECT_EQ(sut.counts().renumbered, 1u);
  EXPECT_EQ(singles(sut.counts()), 1u);
  EXPECT_EQ(sut.counts().partner_missed, 1u);
}

TEST(TriggerPairing, CountsBothFramesOfATriggerThatWereTooFarApart) {
  TriggerPairing<Frame> sut;
  for (std::uint64_t i = 0; i < 6; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    sut.add_right(frame(i, 40.0 * static_cast<double>(i) + (i == 2 ? 9.0 : 0.0)));
  }
  EXPECT_EQ(all(sut).size(), 5u);
  EXPECT_EQ(sut.counts().off_time, 2u);
  EXPECT_EQ(singles(sut.counts()), 2u);
}

TEST(TriggerPairing, CountsFramesFromBeforeTheOtherCameraBegan) {
  TriggerPairing<Frame> sut;
  for (std::uint64_t i = 0; i < 4; ++i) sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
  sut.add_right(frame(0, 80));
  EXPECT_EQ(all(sut).size(), 1u);
  EXPECT_EQ(sut.counts().before_first_pair, 2u);
}

TEST(TriggerPairing, HoldsNoMoreFramesThanItMayWhileTheOtherCameraIsSilent) {
  TriggerPairingSettings settings;
  settings.most_waiting = 3;
  TriggerPairing<Frame> sut(settings);
  for (std::uint64_t i = 0; i < 10; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    EXPECT_FALSE(sut.next());
  }
  EXPECT_EQ(sut.counts().partner_silent, 7u);
}

TEST(TriggerPairing, NeverPairsWrongAndAccountsForEveryFrameOnRandomLoss) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> jitter(0, 0.3);
    TriggerPairing<Frame> sut;
    std::uint64_t left = 1000, right = 7, given = 0, paired = 0;
    for (int trigger = 0; trigger < 400; ++trigger) {
      const auto draw = [&] { return random() % 20; };
      const unsigned long l = draw(), r = draw();
      const bool left_missed = l == 0, right_missed = r == 0;
      const bool left_lost = l == 1, right_lost = r == 1;
      if (!left_missed && !left_lost) sut.add_left(frame(left, 40.0 * trigger + jitter(random))), ++given;
      if (!right_missed && !right_lost) sut.add_right(frame(right, 40.0 * trigger + jitter(random))), ++given;
      left += !left_missed;
      right += !right_missed;
      for (const FramePair<Frame>& p : all(sut)) {
        ++paired;
        ASSERT_LT(std::abs(seconds(p.apart)), 2e-3);
      }
    }
    EXPECT_EQ(paired, sut.counts().pairs);
    EXPECT_GT(paired, 280u);
    const std::uint64_t waiting = given - 2 * paired - singles(sut.counts());
    EXPECT_LE(waiting, 8u);
  }
}

}  // namespace
}  // namespace tankrig
