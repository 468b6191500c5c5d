// The randomness under the renderer.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::sim {
namespace {

TEST(RenderGaussianTable, HasMeanVarianceSkewnessAndKurtosisOfTheNormalDistribution) {
  const GaussianTable& g = GaussianTable::instance();
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0;
  constexpr std::uint64_t kAll = 1u << GaussianTable::kBits;
  for (std::uint64_t i = 0; i < kAll; ++i) {
    const double x = g(i);
    m1 += x, m2 += x * x, m3 += x * x * x, m4 += x * x * x * x;
  }
  EXPECT_NEAR(m1 / kAll, 0, 1e-6);
  EXPECT_NEAR(m2 / kAll, 1, 1e-5);
  EXPECT_NEAR(m3 / kAll, 0, 1e-5);
  EXPECT_NEAR(m4 / kAll, 3, 0.02);
}

TEST(RenderGaussianTable, HasTheTailsOfTheNormalDistribution) {
  const GaussianTable& g = GaussianTable::instance();
  constexpr std::uint64_t kAll = 1u << GaussianTable::kBits;
  int beyond_1 = 0, beyond_3 = 0;
  for (std::uint64_t i = 0; i < kAll; ++i) {
    beyond_1 += std::abs(g(i)) > 1;
    beyond_3 += std::abs(g(i)) > 3;
  }
  EXPECT_NEAR(beyond_1 / double(kAll), 0.31731, 0.001);
  EXPECT_NEAR(beyond_3 / double(kAll), 0.0026998, 0.0001);
}

TEST(RenderHash, GivesNeighbouringCountersIndependentNumbers) {
  double sum = 0, product = 0;
  constexpr int kCount = 1 << 18;
  for (int i = 0; i < kCount; ++i) {
    const double a = unit(mix(7, i)) - 0.5, b = unit(mix(7, i + 1)) - 0.5;
    sum += a, product += a * b;
  }
  EXPECT_NEAR(sum / kCount, 0, 4 * std::sqrt(1 / 12.0 / kCount));
  EXPECT_NEAR(product / kCount, 0, 4 / 12.0 / std::sqrt(kCount));
}

}  // namespace
}  // namespace tankrig::sim
