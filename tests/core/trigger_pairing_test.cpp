#include "core/trigger_pairing.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "drivers/camera/camera.hpp"

namespace tankrig {
namespace {

constexpr Duration kTolerance = std::chrono::milliseconds(2);

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

TEST(TriggerPairing, PairsFramesOfOneTriggerWhateverTheirNumbersBeginWith) {
  TriggerPairing<Frame> sut(kTolerance);
  for (std::uint64_t i = 0; i < 5; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    sut.add_right(frame(100 + i, 40.0 * static_cast<double>(i) + 0.7));
  }
  const std::vector<FramePair<Frame>> pairs = all(sut);
  ASSERT_EQ(pairs.size(), 5u);
  for (const FramePair<Frame>& p : pairs) EXPECT_EQ(p.right.sequence, p.left.sequence + 100);
}

TEST(TriggerPairing, LeavesFramesOfATriggerThatAreTooFarApart) {
  TriggerPairing<Frame> sut(kTolerance);
  for (std::uint64_t i = 0; i < 6; ++i) {
    sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
    sut.add_right(frame(i, 40.0 * static_cast<double>(i) + (i == 2 ? 9.0 : 0.0)));
  }
  const std::vector<FramePair<Frame>> pairs = all(sut);
  ASSERT_EQ(pairs.size(), 5u);
  for (const FramePair<Frame>& p : pairs) EXPECT_NE(p.left.sequence, 2u);
}

TEST(TriggerPairing, BeginsWithTheFirstTriggerThatBothCamerasSaw) {
  TriggerPairing<Frame> sut(kTolerance);
  for (std::uint64_t i = 0; i < 4; ++i) sut.add_left(frame(i, 40.0 * static_cast<double>(i)));
  EXPECT_FALSE(sut.next()) << "the other camera may still bring its frames";
  sut.add_right(frame(0, 80));
  const std::vector<FramePair<Frame>> pairs = all(sut);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].left.sequence, 2u);
}

TEST(TriggerPairing, PairsEveryTriggerThatBothSawAndNoOtherOnRandomLoss) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> jitter(0, 0.3);
    TriggerPairing<Frame> sut(kTolerance);
    std::vector<std::uint64_t> seen_by_both, paired;
    for (std::uint64_t trigger = 0; trigger < 400; ++trigger) {
      const bool left = random() % 10 != 0, right = random() % 10 != 0;
      const double t_ms = 40.0 * static_cast<double>(trigger);
      if (left) sut.add_left(frame(trigger, t_ms + jitter(random)));
      if (right) sut.add_right(frame(trigger, t_ms + jitter(random)));
      if (left && right) seen_by_both.push_back(trigger);
      for (const FramePair<Frame>& p : all(sut)) {
        ASSERT_EQ(p.left.sequence, p.right.sequence);
        paired.push_back(p.left.sequence);
      }
    }
    EXPECT_EQ(paired, seen_by_both);
  }
}

}  // namespace
}  // namespace tankrig
