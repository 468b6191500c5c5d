// The better detector against generated stripes.
#include "reconstruction/stripe/stripe_detector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <opencv2/imgproc.hpp>

#include "core/input_error.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

struct Errors {
  double mean = 0, rms = 0, normalised_rms = 0, worst = 0;
  int count = 0, gross = 0;  ///< gross: more than 2 px off
};

Errors errors_of(const StripeDetection& detection, const GeneratedStripe& truth) {
  Errors e;
  for (const StripePeak& peak : detection.peaks) {
    const double error = peak.position - truth.true_row(static_cast<int>(peak.column));
    if (!(std::abs(error) <= 2)) {
      ++e.gross;
      continue;
    }
    e.mean += error;
    e.rms += error * error;
    e.normalised_rms += std::pow(error / peak.sigma_px, 2);
    e.worst = std::max(e.worst, std::abs(error));
    ++e.count;
  }
  e.mean /= e.count;
  e.rms = std::sqrt(e.rms / e.count);
  e.normalised_rms = std::sqrt(e.normalised_rms / e.count);
  return e;
}

StripeParameters unsmoothed() {
  StripeParameters p;
  p.orientation = StripeOrientation::kColumns;
  p.smoothing_px = 0;
  return p;
}

void expect_complete(const StripeStatistics& s) {
  EXPECT_EQ(s.columns, s.peaks + s.no_peak + s.low_snr + s.ambiguous + s.too_wide + s.skewed + s.edge + s.isolated);
}

TEST(StripeDetector, IsUnbiasedAndNearTheNoiseLimitWithAnHonestSigma) {
  for (const double noise : {2.0, 5.0, 12.0, 25.0}) {
    GeneratedStripe stripe;
    stripe.width = 700;
    stripe.row = [](int x) { return 60 + 0.1137 * x; };
    stripe.scene = [](int, int) { return 60.0; };
    stripe.noise = noise;
    stripe.seed = 11;
    GeneratedStripe dark = stripe;
    dark.laser = false;
    dark.noise = 0;
    const StripeDetection detection = detect_stripe(stripe.image(), dark.image(), unsmoothed());
    const Errors e = errors_of(detection, stripe);
    const double colour_norm = stripe.bgr.norm();
    const double limit = noise / (stripe.peak * colour_norm) * std::sqrt(2 * stripe.sd / std::sqrt(M_PI));
    const double expected = std::hypot(limit, 0.01);
    std::cout << "noise " << noise << " DN (seed 11): bias " << e.mean << " rms " << e.rms << " limit " << limit
              << " px, normalised " << e.normalised_rms << ", " << e.count << " columns\n";
    EXPECT_LT(std::abs(e.mean), 0.02);
    EXPECT_LT(e.rms, 1.3 * expected);
    EXPECT_GT(e.normalised_rms, noise < 5 ? 0.5 : 0.7);  // below 5 DN the speckle floor is most of sigma
    EXPECT_LT(e.normalised_rms, 1.5);
    EXPECT_EQ(e.gross, 0);
    EXPECT_GE(e.count, 0.97 * stripe.width);
    expect_complete(detection.statistics);
  }
}

TEST(StripeDetector, SmoothingLowersTheErrorAndKeepsSigmaHonest) {
  constexpr unsigned kSeeds = 8;
  double squares = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    GeneratedStripe stripe;
    stripe.seed = seed;
    stripe.width = 700;
    stripe.row = [](int x) { return 60 + 0.1137 * x; };
    stripe.noise = 20;
    stripe.scene = [](int, int) { return 100.0; };
    StripeParameters p = unsmoothed();
    const double raw = errors_of(detect_stripe(stripe.image(), {}, p), stripe).rms;
    p.smoothing_px = 2;
    const Errors e = errors_of(detect_stripe(stripe.image(), {}, p), stripe);
    EXPECT_LT(e.rms, 0.6 * raw) << "seed " << seed;
    squares += e.normalised_rms * e.normalised_rms / kSeeds;
  }
  EXPECT_NEAR(std::sqrt(squares), 1, 0.2) << "seeds 1 to " << kSeeds;
}

TEST(StripeDetector, CentresAClippedStripe) {
  for (const double peak : {400.0, 1000.0, 4000.0}) {
    GeneratedStripe stripe;
    stripe.peak = peak;
    stripe.noise = 2;
    const Errors e = errors_of(detect_stripe(stripe.image(), {}, unsmoothed()), stripe);
    std::cout << "peak " << peak << " DN: bias " << e.mean << " rms " << e.rms << " worst " << e.worst << " px\n";
    EXPECT_LT(std::abs(e.mean), 0.05);
    EXPECT_LT(e.rms, 0.08);
    EXPECT_GE(e.count, 0.97 * stripe.width);
  }
}

TEST(StripeDetector, FindsStripesOfAnyColourWidthAndOrientation) {
  const Eigen::Vector3d colours[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {1, 1, 1}, {0.1, 1, 0.6}};
  for (const auto& bgr : colours)
    for (const double sd : {0.9, 2.0, 5.0})
      for (const bool rows : {false, true}) {
        GeneratedStripe stripe;
        stripe.bgr = bgr;
        stripe.sd = sd;
        stripe.noise = 4;
        cv::Mat image = stripe.image();
        if (rows) cv::transpose(image, image);
        const StripeDetection detection = detect_stripe(image, {}, StripeParameters{});
        const Errors e = errors_of(detection, stripe);
        SCOPED_TRACE(testing::Message() << "bgr " << bgr.transpose() << " sd " << sd << " rows " << rows);
        EXPECT_EQ(detection.orientation, rows ? StripeOrientation::kRows : StripeOrientation::kColumns);
        EXPECT_GE(e.count, 0.97 * stripe.width);
        EXPECT_EQ(e.gross, 0);
        EXPECT_LT(std::abs(e.mean), 0.02);
      }
}

TEST(StripeDetector, FindsAFaintStripeOnTextureWithADarkImage) {
  GeneratedStripe stripe;
  stripe.peak = 25;
  stripe.noise = 2;
  stripe.scene = [](int x, int y) { return 90.0 + 60 * ((x / 17 + y / 13) % 2) + 20 * std::sin(0.7 * y); };
  GeneratedStripe dark = stripe;
  dark.laser = false;
  dark.seed = 2;
  const Errors e = errors_of(detect_stripe(stripe.image(), dark.image(), unsmoothed()), stripe);
  EXPECT_GE(e.count, 0.97 * stripe.width);
  EXPECT_EQ(e.gross, 0);
  EXPECT_LT(std::abs(e.mean), 0.05);
}

TEST(StripeDetector, FindsAColouredStripeOnGreyTextureWithoutADarkImage) {
  GeneratedStripe stripe;
  stripe.peak = 80;
  stripe.noise = 2;
  stripe.scene = [](int x, int y) { return 40.0 + 110 * ((x / 17 + y / 13) % 2); };
  const Errors e = errors_of(detect_stripe(stripe.image(), {}, unsmoothed()), stripe);
  EXPECT_GE(e.count, 0.95 * stripe.width);
  EXPECT_LE(e.gross, 2);
  EXPECT_LT(e.rms, 0.3);
}

TEST(StripeDetector, FindsADimStripeInTheDark) {
  GeneratedStripe stripe;
  stripe.peak = 12;
  stripe.scene = [](int, int) { return 1.0; };
  stripe.noise = 0.7;
  const Errors e = errors_of(detect_stripe(stripe.image(), {}, unsmoothed()), stripe);
  EXPECT_GE(e.count, 0.97 * stripe.width);
  EXPECT_LT(std::abs(e.mean), 0.03);
}

TEST(StripeDetector, KeepsTheStripeInNoiseOfATenthOfFullScale) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    GeneratedStripe stripe;
    stripe.width = 720;
    stripe.height = 576;
    stripe.row = [](int x) { return 250 + 0.0937 * x; };
    stripe.noise = 25;
    stripe.seed = seed;
    const StripeDetection detection = detect_stripe(stripe.image(), {}, StripeParameters{});
    const Errors e = errors_of(detection, stripe);
    std::cout << "seed " << seed << ": " << e.count << " of 720 columns, rms " << e.rms << " px\n";
    EXPECT_GE(e.count, 0.97 * 720);
    EXPECT_LE(e.gross, 1);
  }
}

TEST(StripeDetector, ReportsNothingWhereThereIsNoStripe) {
  for (const double noise : {0.0, 1.0, 8.0, 25.0})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      GeneratedStripe empty;
      empty.width = 720;
      empty.height = 576;
      empty.laser = false;
      empty.noise = noise;
      empty.seed = seed;
      empty.scene = [](int, int) { return 30.0; };
      GeneratedStripe dark = empty;
      dark.noise = noise / 4;
      dark.seed = 100 + seed;
      SCOPED_TRACE(testing::Message() << "noise " << noise << " seed " << seed);
      EXPECT_EQ(detect_stripe(empty.image(), {}, StripeParameters{}).peaks.size(), 0u);
      EXPECT_EQ(detect_stripe(empty.image(), dark.image(), StripeParameters{}).peaks.size(), 0u);
    }
}

TEST(StripeDetector, TakesTheBandsOfARoundedGlowForNoStripe) {
  // The water's glow around a beam, in pictures without noise: where it only just reaches the next grey level, it is a line.
  for (const double over : {0.501, 0.51, 0.52, 0.55, 0.6})
    for (const double level : {0.0, 1.0, 2.0}) {
      GeneratedStripe glow;
      glow.width = 480, glow.height = 360;
      glow.sd = 40;
      glow.peak = level + over;
      GeneratedStripe dark = glow;
      dark.laser = false;
      SCOPED_TRACE(testing::Message() << "a glow of " << glow.peak << " DN");
      EXPECT_EQ(detect_stripe(glow.image(), dark.image(), StripeParameters{}).peaks.size(), 0u);
      EXPECT_EQ(detect_stripe(glow.image(), {}, StripeParameters{}).peaks.size(), 0u);
    }
}

cv::Mat of_wood(cv::Mat image) {
  image.forEach<cv::Vec3b>([](cv::Vec3b& pixel, const int*) { pixel[0] /= 2; });
  return image;
}

TEST(StripeDetector, TakesABrightLineForNoStripeWhereThereIsADarkOneLikeIt) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    GeneratedStripe empty;
    empty.laser = false;
    empty.noise = 2;
    empty.seed = seed;
    empty.scene = [](int x, int y) {
      const auto line = [&](double row) { return 60 * std::exp(-0.125 * std::pow(y - row - 0.1 * x, 2)); };
      return 100 + line(60) - line(120);
    };
    EXPECT_EQ(detect_stripe(of_wood(empty.image()), {}, StripeParameters{}).peaks.size(), 0u) << "seed " << seed;
  }
}

TEST(StripeDetector, TakesTheEdgeOfATableForNoStripe) {
  GeneratedStripe empty;
  empty.laser = false;
  empty.noise = 2;
  empty.scene = [](int x, int y) { return y > 110 + 0.1 * x ? 140.0 : 60.0; };
  EXPECT_EQ(detect_stripe(of_wood(empty.image()), {}, StripeParameters{}).peaks.size(), 0u);
}

/// A cable of red plastic, 4 px thick: what it covers is not seen in the other channels either.
cv::Mat with_red_cable(cv::Mat image, double row, int columns) {
  image.forEach<cv::Vec3b>([&](cv::Vec3b& pixel, const int* at) {
    if (at[1] < columns && std::abs(at[0] - row - 10 * std::sin(at[1] / 25.0)) < 2) pixel = {55, 36, 150};
  });
  return image;
}

GeneratedStripe in_a_lit_room() {
  GeneratedStripe stripe;
  stripe.bgr = {0.04, 0.06, 1};
  stripe.peak = 110;
  stripe.noise = 2;
  stripe.row = [](int x) { return 60 + 0.1 * x; };
  stripe.scene = [](int x, int y) { return 80 + 7 * std::sin(0.35 * x + 0.2 * y) + 5 * std::sin(0.9 * y); };
  return stripe;
}

TEST(StripeDetector, TakesARedCableForNoStripe) {
  GeneratedStripe empty = in_a_lit_room();
  empty.laser = false;
  EXPECT_EQ(detect_stripe(with_red_cable(empty.image(), 140, empty.width), {}, StripeParameters{}).peaks.size(), 0u);
}

TEST(StripeDetector, TakesARedCableForNoRivalOfTheStripe) {
  const GeneratedStripe stripe = in_a_lit_room();
  const StripeDetection detection = detect_stripe(with_red_cable(stripe.image(), 140, 90), {}, unsmoothed());
  const Errors e = errors_of(detection, stripe);
  EXPECT_GE(e.count, 0.97 * stripe.width);
  EXPECT_EQ(e.gross, 0);
}

TEST(StripeDetector, FitsTheProfileByTheSurfaceBesideIt) {
  const GeneratedStripe stripe = in_a_lit_room();
  cv::Mat image = stripe.image();
  image.forEach<cv::Vec3b>([](cv::Vec3b& pixel, const int* at) {  // yellow and blue things far from the stripe
    if (at[0] > 120 && (at[0] / 6 + at[1] / 20) % 2 == 0)
      pixel = at[1] % 40 < 20 ? cv::Vec3b(40, 170, 200) : cv::Vec3b(120, 60, 40);
  });
  const Errors e = errors_of(detect_stripe(image, {}, unsmoothed()), stripe);
  std::cout << "rms " << e.rms << " px, " << e.count << " columns\n";
  EXPECT_GE(e.count, 0.97 * stripe.width);
  EXPECT_LT(e.rms, 0.04);
}

TEST(StripeDetector, FollowsAStripeThatIsWeakEverywhere) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    GeneratedStripe stripe;
    stripe.width = 480, stripe.height = 360;
    stripe.sd = 2, stripe.noise = 8, stripe.peak = 2 * stripe.noise;
    stripe.scene = [](int, int) { return 60.0; };
    stripe.seed = seed;
    const Errors e = errors_of(detect_stripe(stripe.image(), {}, StripeParameters{}), stripe);
    std::cout << "seed " << seed << ": " << e.count << " of 480 columns, rms " << e.rms << " px\n";
    EXPECT_GE(e.count, 0.95 * 480);
    EXPECT_LE(e.gross, 5);
    EXPECT_LT(e.rms, 0.4);
  }
}

TEST(StripeDetector, PutsNoPointBetweenTheSidesOfADepthJump) {
  for (const double jump : {6.0, 14.0, 60.0}) {
    GeneratedStripe stripe;
    stripe.noise = 3;
    stripe.row = [&](int x) { return 60 + 0.05 * x + (x >= 120 ? jump : 0); };
    cv::Mat image = stripe.image();
    cv::GaussianBlur(image, image, {0, 0}, 1.0);  // optics mix the two sides
    const StripeDetection detection = detect_stripe(image, {}, unsmoothed());
    int between = 0;
    for (const StripePeak& peak : detection.peaks) {
      const double lower = 60 + 0.05 * peak.column;
      const double off = std::min(std::abs(peak.position - lower), std::abs(peak.position - lower - jump));
      between += off > 0.5;
    }
    EXPECT_EQ(between, 0) << "jump " << jump;
    EXPECT_GE(detection.peaks.size(), stripe.width - 12u);
    expect_complete(detection.statistics);
  }
}

TEST(StripeDetector, RejectsParticles) {
  GeneratedStripe stripe;
  stripe.noise = 2;
  stripe.row = [](int x) { return x >= 100 && x < 140 ? NAN : 120 + 0.05 * x; };
  cv::Mat image = stripe.image();
  for (const cv::Point& centre : {cv::Point{20, 40}, {60, 170}, {118, 60}, {200, 30}})
    cv::circle(image, centre, 2, {60, 255, 90}, -1, cv::LINE_AA);
  const StripeDetection detection = detect_stripe(image, {}, StripeParameters{});
  EXPECT_EQ(errors_of(detection, stripe).gross, 0);
  EXPECT_GE(detection.peaks.size(), 190u);
  EXPECT_GT(detection.statistics.isolated + detection.statistics.low_snr + detection.statistics.edge, 0u);
  for (const StripePeak& peak : detection.peaks) EXPECT_FALSE(peak.column >= 100 && peak.column < 140);
}

TEST(StripeDetector, CountsAReflectionAlmostAsStrongAsAmbiguous) {
  GeneratedStripe stripe, reflection;
  stripe.row = [](int) { return 50.3; };
  reflection.row = [](int x) { return x < 120 ? 140.2 : NAN; };
  reflection.peak = 0.97 * stripe.peak;
  const cv::Mat image = cv::max(stripe.image(), reflection.image());
  const StripeDetection detection = detect_stripe(image, {}, unsmoothed());
  EXPECT_GE(detection.statistics.ambiguous, 100u);
  EXPECT_GE(detection.peaks.size(), 110u);
  EXPECT_EQ(errors_of(detection, stripe).gross, 0);
}

TEST(StripeDetector, RefusesImagesItCannotRead) {
  EXPECT_THROW(detect_stripe(cv::Mat(10, 10, CV_16UC1), {}, {}), InputError);
  EXPECT_THROW(detect_stripe(cv::Mat(), {}, {}), InputError);
  EXPECT_THROW(detect_stripe(cv::Mat(64, 64, CV_8UC3), cv::Mat(64, 60, CV_8UC3), {}), InputError);
}

TEST(StripeDetector, SurvivesTinyImages) {
  for (const int size : {1, 2, 5, 9, 17, 33}) {
    const cv::Mat image(size, size, CV_8UC3, cv::Scalar(10, 200, 30));
    EXPECT_TRUE(detect_stripe(image, {}, {}).peaks.empty()) << size;
  }
}

TEST(MedianBackground, IsThePixelwiseMedian) {
  std::vector<cv::Mat> images;
  for (const int value : {10, 200, 12, 11, 14})
    images.emplace_back(4, 6, CV_8UC3, cv::Scalar(value, 2 * value % 256, 7));
  EXPECT_EQ(median_background(images).at<cv::Vec3b>(3, 5), cv::Vec3b(12, 24, 7));
  images.pop_back();
  EXPECT_EQ(median_background(images).at<cv::Vec3b>(0, 0)[0], 12);  // (11 + 12) / 2, rounded up
  EXPECT_THROW(median_background({}), InputError);
}

}  // namespace
}  // namespace tankrig
