// How a known stripe is followed into another image: by a few columns where it is clear, else by the reduced image.
#include "reconstruction/stripe/find/stripe_look.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

constexpr int kFew = 60;  ///< columns: fewer than a reduced image has

GeneratedStripe clear_stripe() {
  GeneratedStripe stripe;
  stripe.width = 640;
  stripe.height = 240;
  stripe.noise = 2;
  stripe.row = [](int x) { return (x > 200 && x < 400 ? 70.3 : 150.7) + 0.05 * x; };
  return stripe;
}

cv::Mat dark_image(GeneratedStripe stripe) {
  stripe.laser = false;
  stripe.seed = 99;
  return stripe.image();
}

/// How `stripe` is followed that `clear_stripe` has shown.
StripeLook followed(const GeneratedStripe& stripe) {
  const GeneratedStripe first = clear_stripe();
  const StripeLook known = find_look(first.image(), dark_image(first), StripeOrientation::kColumns);
  return follow_look(stripe.image(), dark_image(stripe), known);
}

int crossed(const StripeLook& look) {
  return static_cast<int>(std::ranges::count_if(look.rows, [](float row) { return std::isfinite(row); }));
}

TEST(StripeLook, FollowsAClearStripeByAFewOfItsColumns) {
  GeneratedStripe stripe = clear_stripe();
  stripe.seed = 2;
  const StripeLook look = followed(stripe);
  EXPECT_GT(crossed(look), 40);
  EXPECT_LT(crossed(look), kFew);
  for (std::size_t i = 0; i < look.rows.size(); ++i) {
    if (std::isnan(look.rows[i])) continue;
    EXPECT_NEAR(look.rows[i], stripe.true_row(static_cast<int>(i) * look.step + look.step / 2), 0.5) << i;
  }
}

TEST(StripeLook, FollowsByTheWholeImageWhatIsNotClear) {
  GeneratedStripe weak = clear_stripe();
  weak.peak = 14;
  EXPECT_GT(crossed(followed(weak)), kFew) << "weak";

  GeneratedStripe clipped = clear_stripe();
  clipped.peak = 600;
  EXPECT_GT(crossed(followed(clipped)), kFew) << "clipped";

  GeneratedStripe partly = clear_stripe();
  partly.row = [whole = partly.row](int x) { return x < 300 ? NAN : whole(x); };
  EXPECT_GT(crossed(followed(partly)), kFew) << "only on a part of the columns";

  const GeneratedStripe first = clear_stripe();
  const StripeLook known = find_look(first.image(), dark_image(first), StripeOrientation::kColumns);
  cv::Mat two = first.image();
  const cv::Mat one = two.clone();
  for (int y = 0; y + 40 < two.rows; ++y)
    for (int x = 0; x < two.cols; ++x)
      if (one.at<cv::Vec3b>(y, x)[1] > 40) two.at<cv::Vec3b>(y + 40, x) = one.at<cv::Vec3b>(y, x);
  EXPECT_GT(crossed(follow_look(two, dark_image(first), known)), kFew) << "beside another as strong";
}

/// None of the dark columns, one in 36, is among those that are looked at; the stripe is found there all the same.
TEST(StripeLook, LosesNoPointsBetweenTheColumnsThatItLooksAt) {
  GeneratedStripe stripe = clear_stripe();
  stripe.reflectance = [](int x, int) { return x % 36 == 0 ? 0.1 : 1.0; };
  const cv::Mat image = stripe.image(), dark = dark_image(stripe);
  const StripeLook known = find_look(image, dark, StripeOrientation::kColumns);
  EXPECT_LT(crossed(follow_look(image, dark, known)), kFew);
  const StripeDetection detection = detect_stripe(image, dark, {}, known);
  EXPECT_GE(detection.peaks.size(), 0.99 * stripe.width);
}

TEST(StripeLook, OfAWideStripeFindsNothingInAFewRows) {
  for (const int rows : {1, 2, 3, 5}) {
    GeneratedStripe strip = clear_stripe();
    strip.height = rows;
    strip.laser = false;
    StripeLook wide;
    wide.weights = {0, 1, 0};
    wide.sd_px = 8;
    EXPECT_TRUE(detect_stripe(strip.image(), dark_image(strip), {}, wide).peaks.empty()) << rows;
  }
}

}  // namespace
}  // namespace tankrig
