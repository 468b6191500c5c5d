// The histogram's percentiles against those of the sorted values themselves.
#include "core/histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace tankrig {
namespace {

Duration ns(std::int64_t value) { return Duration{value}; }

/// The smallest value that at least `share` of all are not above.
std::int64_t true_quantile(const std::vector<std::int64_t>& sorted, double share) {
  const double rank = std::ceil(share * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

void expect_quantiles_of(std::vector<std::int64_t> values) {
  Histogram sut;
  for (const std::int64_t v : values) sut.add(ns(v));
  std::sort(values.begin(), values.end());
  for (const double share : {0.0, 0.001, 0.1, 0.25, 0.5, 0.9, 0.99, 0.999, 0.99999, 1.0}) {
    const auto truth = static_cast<double>(true_quantile(values, share));
    const auto told = static_cast<double>(sut.quantile(share).count());
    EXPECT_GE(told, truth) << share;
    EXPECT_LE(told, truth * (1 + 1.0 / 64)) << share;
  }
  EXPECT_EQ(sut.count(), values.size());
  EXPECT_EQ(sut.min().count(), values.front());
  EXPECT_EQ(sut.max().count(), values.back());
  EXPECT_EQ(sut.quantile(1), sut.max());
}

TEST(Histogram, QuantilesAreNeverBelowTheTruthAndAtMostOneInSixtyFourAbove) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> decades(0, 10.8);
  std::exponential_distribution<double> tail(1 / 20e3);
  std::vector<std::int64_t> spread, latencies, few;
  for (int i = 0; i < 50'000; ++i) spread.push_back(static_cast<std::int64_t>(std::pow(10.0, decades(random))));
  for (int i = 0; i < 50'000; ++i) latencies.push_back(static_cast<std::int64_t>(3000 + tail(random)));
  for (int i = 0; i < 7; ++i) few.push_back(static_cast<std::int64_t>(tail(random)));
  expect_quantiles_of(spread);
  expect_quantiles_of(latencies);
  expect_quantiles_of(few);
}

TEST(Histogram, IsExactWhereEveryNanosecondHasItsBin) {
  Histogram sut;
  for (int i = 0; i < 128; ++i) sut.add(ns(i));
  for (int i = 1; i <= 128; ++i) EXPECT_EQ(sut.quantile(i / 128.0).count(), i - 1);
}

TEST(Histogram, BinsHoldEveryValueAndLeaveNoGap) {
  Histogram sut;
  std::vector<std::int64_t> values;
  for (int bit = 0; bit < 36; ++bit)
    for (const std::int64_t off : {-1, 0, 1})
      values.push_back(std::max<std::int64_t>((std::int64_t{1} << bit) + off, 0));
  for (const std::int64_t v : values) sut.add(ns(v));
  std::uint64_t all = 0;
  std::int64_t before = -1;
  sut.for_each_bin([&](const Histogram::Bin& bin) {
    EXPECT_GT(bin.lower, before);
    EXPECT_LE(bin.lower, bin.upper);
    EXPECT_LE(bin.upper - bin.lower, bin.lower / 64);
    const auto inside = [&](std::int64_t v) { return v >= bin.lower && v <= bin.upper; };
    EXPECT_EQ(bin.count, static_cast<std::uint64_t>(std::count_if(values.begin(), values.end(), inside)));
    all += bin.count;
    before = bin.upper;
  });
  EXPECT_EQ(all, values.size());
}

TEST(Histogram, TakesWhatIsOutOfItsRange) {
  Histogram sut;
  sut.add(ns(-5));
  EXPECT_EQ(sut.quantile(1).count(), 0);
  const Duration hour = std::chrono::hours(1);
  sut.add(hour);
  EXPECT_EQ(sut.quantile(1), hour);
  EXPECT_EQ(sut.max(), hour);
}

TEST(Histogram, OfNothingIsZero) {
  const Histogram sut;
  EXPECT_EQ(sut.count(), 0u);
  EXPECT_EQ(sut.quantile(0.5).count(), 0);
  EXPECT_EQ(sut.min().count() + sut.max().count() + sut.mean().count(), 0);
}

}  // namespace
}  // namespace tankrig
