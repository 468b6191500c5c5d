#include "drivers/laser/latest_value.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace tankrig {
namespace {

struct Pair {
  std::uint64_t first = 0, twice = 0;
};

TEST(LatestValue, IsTheDefaultBeforeAnyIsPublished) {
  LatestValue<int> sut;
  EXPECT_EQ(sut.latest(), 0);
}

TEST(LatestValue, IsTheNewestHoweverManyWerePublished) {
  LatestValue<int> sut;
  for (int i = 1; i <= 10; ++i) sut.publish(i);
  EXPECT_EQ(sut.latest(), 10);
  EXPECT_EQ(sut.latest(), 10);
  sut.publish(11);
  EXPECT_EQ(sut.latest(), 11);
}

TEST(LatestValue, IsNeverTornAndNeverOlderThanBefore) {
  LatestValue<Pair> sut;
  constexpr std::uint64_t kLast = 300000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) sut.publish({i, 2 * i});
  });
  std::uint64_t seen = 0;
  while (seen < kLast) {
    const Pair pair = sut.latest();
    ASSERT_EQ(pair.twice, 2 * pair.first);
    ASSERT_GE(pair.first, seen);
    seen = pair.first;
  }
  writer.join();
}

}  // namespace
}  // namespace tankrig
