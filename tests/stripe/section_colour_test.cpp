// Lines beside the stripe that could be its reflection.
#include "reconstruction/stripe/fit/section_colour.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "reconstruction/stripe/find/ridge_filter.hpp"
#include "reconstruction/stripe/stripe_parameters.hpp"

namespace tankrig {
namespace {

constexpr int kColumns = 40, kStripe = 30, kOther = 80;  // columns of the image, rows of two lines

/// Whether the line of that green at kOther is a rival of the stripe at kStripe, whose core is of that one.
bool is_rival(int green, int stripe_green) {
  cv::Mat3b image(120, kColumns, cv::Vec3b(10, 10, 10));
  image.row(kOther) = cv::Vec3b(10, static_cast<std::uint8_t>(green), 10);
  image.row(kStripe) = cv::Vec3b(200, static_cast<std::uint8_t>(stripe_green), 200);
  for (const int row : {kStripe - 1, kStripe + 1, kOther - 1, kOther + 1}) image.row(row) = cv::Vec3b(10, 90, 10);
  RidgeCandidates candidates(cv::Mat1f(image.size(), 0.0f), 1, 1);
  for (int column = 0; column < kColumns; ++column) {
    candidates.add(column, {kStripe, 20}, true);
    candidates.add(column, {kOther, 19}, true);
  }
  StripeAppearance appearance;
  appearance.light = {0, 1, 0};
  appearance.colour = {0, 150, 0};
  appearance.noise = appearance.sd_px = 1;
  const SectionColours colours(image, cv::Mat(), appearance, 6);
  return colours.has_rival(candidates, {kColumns / 2, {kStripe, 20}}, StripeParameters{});
}

TEST(SectionColours, ALineAlmostAsBrightIsARival) {
  EXPECT_TRUE(is_rival(190, 200));
  EXPECT_TRUE(is_rival(255, 255));
}

/// Nearly white, the core shows little of the laser's colour, and all the same more light.
TEST(SectionColours, ALineThatDoesNotClipIsNoRivalOfOneThatDoes) { EXPECT_FALSE(is_rival(190, 255)); }

}  // namespace
}  // namespace tankrig
