#include "drivers/camera/frame_id.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

using Width = FrameIdSequence::Width;

TEST(FrameIdSequence, BeginsAtZeroAndCountsOn) {
  FrameIdSequence sut;
  EXPECT_EQ(sut.next(65401).sequence, 0u);
  EXPECT_EQ(sut.next(65402).sequence, 1u);
}

TEST(FrameIdSequence, Skips0WhenA16BitIdWraps) {
  FrameIdSequence sut;
  sut.next(65534);
  EXPECT_EQ(sut.next(65535).lost, 0u);
  const FrameIdSequence::Step wrapped = sut.next(1);
  EXPECT_EQ(wrapped.sequence, 2u);
  EXPECT_EQ(wrapped.lost, 0u);
  EXPECT_FALSE(wrapped.restarted);
}

TEST(FrameIdSequence, CountsAGapAlsoAcrossTheWrap) {
  FrameIdSequence sut;
  sut.next(65534);
  const FrameIdSequence::Step step = sut.next(3);  // 65535, 1 and 2 never came
  EXPECT_EQ(step.lost, 3u);
  EXPECT_EQ(step.sequence, 4u);
}

TEST(FrameIdSequence, TellsALateFrameFromARestart) {
  FrameIdSequence sut;
  sut.next(100);
  sut.next(102);
  const FrameIdSequence::Step late = sut.next(101);
  EXPECT_TRUE(late.late);
  EXPECT_EQ(late.sequence, 1u);
  EXPECT_TRUE(sut.next(102).late) << "the same frame once more";
  const FrameIdSequence::Step next = sut.next(103);
  EXPECT_EQ(next.sequence, 3u);
  EXPECT_EQ(next.lost, 0u);
  const FrameIdSequence::Step anew = sut.next(1);
  EXPECT_TRUE(anew.restarted);
  EXPECT_EQ(anew.sequence, 4u);
  EXPECT_EQ(anew.lost, 0u);
}

TEST(FrameIdSequence, GoesOnAfterARestartItWasToldOf) {
  FrameIdSequence sut;
  sut.next(100);
  sut.restart();
  const FrameIdSequence::Step step = sut.next(300);
  EXPECT_TRUE(step.restarted);
  EXPECT_EQ(step.lost, 0u);
  EXPECT_EQ(step.sequence, 1u);
}

TEST(FrameIdSequence, Passes64BitIdsThrough) {
  FrameIdSequence sut(Width::k64);
  sut.next(0x1'0000'FFFEull);
  EXPECT_EQ(sut.next(0x1'0000'FFFFull).lost, 0u);
  EXPECT_EQ(sut.next(0x1'0001'0000ull).lost, 0u) << "0 in the low half is an id like any other";
  EXPECT_EQ(sut.next(0x1'0001'9000ull).sequence, 2u + 0x9000u) << "no wrap at 65535, no restart by distance";
}

TEST(FrameIdSequence, DoesNotCountAsLostWhatCameWithoutItsNumber) {
  FrameIdSequence sut;
  EXPECT_EQ(sut.next(10, 2).sequence, 2u) << "two came before the first that has a number";
  EXPECT_EQ(sut.next(14, 1).lost, 2u);
  sut.restart();
  EXPECT_EQ(sut.next(1, 3).sequence, 10u);
}

TEST(FrameIdSequence, AgreesWithTheTruthOnRandomLossOverManyWraps) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    FrameIdSequence sut;
    std::uint64_t truth = 0, lost = 0, counted = 0;
    for (int i = 0; i < 300'000; ++i) {
      const FrameIdSequence::Step step = sut.next((65400 + truth) % 65535 + 1);
      ASSERT_EQ(step.sequence, truth);
      counted += step.lost;
      const std::uint64_t gap = random() % 50 == 0 ? random() % 30000 : random() % 10 == 0;
      lost += i + 1 < 300'000 ? gap : 0;
      truth += 1 + gap;
    }
    EXPECT_EQ(counted, lost);
  }
}

}  // namespace
}  // namespace tankrig
