// What is written once for a double and for four: each lane has the bits of the double alone.
#include "reconstruction/stripe/lanes.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "reconstruction/stripe/runs/run_line.hpp"

namespace tankrig {
namespace {

constexpr unsigned kLaneSeed = 1;

TEST(Lanes, PowersOfEAreThoseOfTheLibrary) {
  std::mt19937 random(kLaneSeed);
  std::uniform_real_distribution<double> powers(-600, 600), near(-2, 2);
  for (int i = 0; i < 10000; ++i) {
    const double x = i % 2 ? powers(random) : near(random);
    EXPECT_NEAR(exponential(x) / std::exp(x), 1, 1e-15) << x;
    EXPECT_EQ(exponential(FourDoubles{} + x)[i % kLanes], exponential(x)) << x;
  }
  EXPECT_EQ(exponential(0.0), 1.0);
  EXPECT_EQ(exponential(-1e9), exponential(-700.0));
}

TEST(Lanes, OneThatHoldsIsSeenInAnyPlace) {
  EXPECT_FALSE(any(FourDoubles{} > 0));
  for (int lane = 0; lane < kLanes; ++lane) {
    FourDoubles x = {};
    x[lane] = 1;
    EXPECT_TRUE(any(x > 0)) << lane;
  }
}

TEST(Lanes, LinesThroughPointsAreThoseOfEachLane) {
  std::mt19937 random(kLaneSeed);
  std::uniform_real_distribution<double> position(-1, 1), weight(0.5, 20);
  for (const int points : {1, 2, 3, 4, 21}) {
    std::vector<LinePoint<FourDoubles>> in(static_cast<std::size_t>(points));
    for (int i = 0; i < points; ++i)
      for (int lane = 0; lane < kLanes; ++lane) {
        in[i].column[lane] = i + (i > 2 ? lane : 0);
        in[i].position[lane] = position(random);
        in[i].weight[lane] = weight(random);
      }
    const FourDoubles at = {0, 1, 2, 3};
    const auto lines = fit_line<true, FourDoubles>(points, at, [&](int i) { return in[i]; });
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto alone = fit_line<true, double>(points, at[lane], [&](int i) {
        return LinePoint<double>{in[i].column[lane], in[i].position[lane], in[i].weight[lane]};
      });
      const RunLine<double> line = lane_of(lines, lane);
      ASSERT_EQ(line.ok, alone.ok) << points;
      if (!alone.ok) continue;
      EXPECT_EQ(line.value, alone.value) << points;
      EXPECT_EQ(line.slope, alone.slope) << points;
      EXPECT_EQ(line.variance, alone.variance) << points;
      EXPECT_EQ(line.slope_variance, alone.slope_variance) << points;
      EXPECT_EQ(line.covariance, alone.covariance) << points;
      EXPECT_EQ(line.chi2, alone.chi2) << points;
      EXPECT_EQ(line.bend, alone.bend) << points;
      EXPECT_EQ(line.bend_variance, alone.bend_variance) << points;
      EXPECT_EQ(line.bend_at, alone.bend_at) << points;
    }
  }
}

}  // namespace
}  // namespace tankrig
