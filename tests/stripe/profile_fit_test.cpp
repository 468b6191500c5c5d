// Profiles fitted together, several at a time, beside each of them alone: the same bits.
#include "reconstruction/stripe/fit/profile_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tankrig {
namespace {

constexpr unsigned kFitSeed = 1;
constexpr int kRows = 60;
constexpr double kProfileSd = 1.7, kProfileHeight = 80;

struct Column {
  std::vector<float> values;
  double centre, start;
};

/// Gaussian profiles on a slope, of any height from none to clear, some so near the border that their window is cut.
std::vector<Column> columns(int count, double noise) {
  std::mt19937 random(kFitSeed);
  std::normal_distribution<double> normal(0, noise);
  std::uniform_real_distribution<double> place(1, kRows - 2), off(-1, 1), share(-0.2, 1);
  std::vector<Column> out;
  for (int i = 0; i < count; ++i) {
    Column column{{}, place(random), 0};
    column.start = column.centre + off(random);
    const double amplitude = kProfileHeight * share(random);
    for (int y = 0; y < kRows; ++y)
      column.values.push_back(static_cast<float>(
          20 + 0.3 * y + normal(random) + amplitude * std::exp(-0.5 * std::pow((y - column.centre) / kProfileSd, 2))));
    out.push_back(column);
  }
  return out;
}

std::vector<ProfileSection> sections_of(const std::vector<Column>& columns) {
  std::vector<ProfileSection> out;
  for (const Column& column : columns) out.push_back({column.values.data(), kRows, column.start});
  return out;
}

TEST(ProfilesFittedTogether, AreThoseFittedAloneToTheBit) {
  for (const bool sloped : {false, true})
    for (const double contrast : {0.0, 0.4})
      for (const int count : {0, 1, 3, 4, 5, 200}) {
        const ProfileFitter fitter(kProfileSd, sloped);
        const ValueNoise noise{2, contrast};
        const std::vector<Column> all = columns(count, 2);
        const std::vector<ProfileFit> together = fitter.fit(sections_of(all), noise);
        ASSERT_EQ(together.size(), all.size());
        for (std::size_t i = 0; i < all.size(); ++i) {
          const ProfileFit alone = fitter.fit({all[i].values.data(), kRows, all[i].start}, noise);
          ASSERT_EQ(together[i].ok, alone.ok) << i;
          EXPECT_EQ(together[i].position, alone.position) << i;
          EXPECT_EQ(together[i].sigma, alone.sigma) << i;
          EXPECT_EQ(together[i].amplitude, alone.amplitude) << i;
          EXPECT_EQ(together[i].amplitude_sigma, alone.amplitude_sigma) << i;
          EXPECT_EQ(together[i].width_ratio, alone.width_ratio) << i;
          EXPECT_EQ(together[i].width_sigma, alone.width_sigma) << i;
          EXPECT_EQ(together[i].skewness, alone.skewness) << i;
          EXPECT_EQ(together[i].skewness_sigma, alone.skewness_sigma) << i;
          EXPECT_EQ(together[i].misfit, alone.misfit) << i;
        }
      }
}

TEST(ProfilesFittedTogether, HaveTheirCentresWhereTheyAre) {
  const ProfileFitter fitter(kProfileSd, true);
  const std::vector<Column> all = columns(200, 0);
  const std::vector<ProfileFit> fits = fitter.fit(sections_of(all), {0.01, 0});
  int found = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto [first, last] = fitter.window(kRows, all[i].start);
    if (!fits[i].ok || last - first < 2 * fitter.half_window() || fits[i].amplitude < 0.05 * kProfileHeight) continue;
    EXPECT_NEAR(fits[i].position, all[i].centre, 1e-3) << i;
    ++found;
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace tankrig
