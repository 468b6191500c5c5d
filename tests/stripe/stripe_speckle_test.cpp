// Rough light, bent surfaces and edges: what a real laser on a real object does to the detector.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <opencv2/imgproc.hpp>

#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

struct SpeckleErrors {
  double rms = 0, normalised_rms = 0, worst = 0;
};

SpeckleErrors speckle_errors(const StripeDetection& detection, const GeneratedStripe& truth) {
  SpeckleErrors e;
  for (const StripePeak& peak : detection.peaks) {
    const double error = peak.position - truth.true_row(static_cast<int>(peak.column));
    e.rms += error * error;
    e.normalised_rms += std::pow(error / std::max(peak.sigma_px, 1e-6f), 2);
    e.worst = std::max(e.worst, std::abs(error));
  }
  const auto n = static_cast<double>(detection.peaks.size());
  e.rms = std::sqrt(e.rms / n);
  e.normalised_rms = std::sqrt(e.normalised_rms / n);
  return e;
}

StripeParameters columns(int smoothing_px) {
  StripeParameters p;
  p.orientation = StripeOrientation::kColumns;
  p.smoothing_px = smoothing_px;
  return p;
}

GeneratedStripe speckled(double noise, unsigned seed) {
  GeneratedStripe stripe;
  stripe.width = 700;
  stripe.peak = 130;
  stripe.row = [](int x) { return 60 + 0.1137 * x; };
  stripe.scene = [](int, int) { return 0.0; };
  stripe.speckle = 0.2;
  stripe.noise = noise;
  stripe.seed = seed;
  return stripe;
}

cv::Mat dark_of(GeneratedStripe stripe) {
  stripe.laser = false;
  stripe.noise = 0;
  return stripe.image();
}

TEST(StripeSpeckle, LeavesASmallerErrorThanTheCentreOfMassesInDarkness) {
  double all_paper = 0, all_raw = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const GeneratedStripe stripe = speckled(0, seed);
    const cv::Mat image = stripe.image();
    const double paper = speckle_errors(detect_paper(image, PaperStripeParameters::simulation()), stripe).rms;
    const double raw = speckle_errors(detect_stripe(image, dark_of(stripe), columns(0)), stripe).rms;
    const double smoothed = speckle_errors(detect_stripe(image, dark_of(stripe), columns(10)), stripe).rms;
    std::cout << "seed " << seed << ": centre of masses " << paper << ", ours unsmoothed " << raw << ", smoothed "
              << smoothed << " px\n";
    EXPECT_LT(smoothed, 0.5 * paper);
    all_paper += paper;
    all_raw += raw;
  }
  EXPECT_LT(all_raw, all_paper);
}

TEST(StripeSpeckle, LeavesSigmaHonest) {
  for (const double noise : {0.5, 2.0, 5.0, 12.0})
    for (const int smoothing : {0, 10}) {
      GeneratedStripe stripe = speckled(noise, 5);
      stripe.scene = [](int, int) { return 50.0; };
      const SpeckleErrors e =
          speckle_errors(detect_stripe(stripe.image(), dark_of(stripe), columns(smoothing)), stripe);
      std::cout << "noise " << noise << " DN, smoothing " << smoothing << " (seed 5): rms " << e.rms
                << " px, normalised " << e.normalised_rms << "\n";
      EXPECT_GT(e.normalised_rms, 0.7);
      EXPECT_LT(e.normalised_rms, 1.5);
    }
}

TEST(StripeSmoothing, StopsAtABend) {
  GeneratedStripe stripe = speckled(2, 7);
  stripe.row = [](int x) { return 60 + 0.3 * std::min(x, 350) - 0.4 * std::max(x - 350, 0); };
  stripe.height = 260;
  const StripeDetection detection = detect_stripe(stripe.image(), dark_of(stripe), columns(10));
  StripeDetection near = detection;
  std::erase_if(near.peaks, [](const StripePeak& peak) { return std::abs(peak.column - 350) > 12; });
  const SpeckleErrors e = speckle_errors(near, stripe);
  std::cout << "within 12 columns of the bend: rms " << e.rms << ", worst " << e.worst << " px (seed 7)\n";
  EXPECT_GE(near.peaks.size(), 24u);
  EXPECT_LT(e.rms, 0.12);
  EXPECT_LT(e.worst, 0.4);
}

TEST(StripeEdges, LeaveOutTheBlurBeyondTheEndOfASurface) {
  GeneratedStripe stripe;
  stripe.noise = 0.5;
  stripe.row = [](int x) { return x < 60 || x > 160 ? NAN : 40 + 0.8 * x; };
  cv::Mat image = stripe.image();
  cv::GaussianBlur(image, image, {0, 0}, 1.3);
  const StripeDetection detection = detect_stripe(image, {}, columns(0));
  EXPECT_GE(detection.peaks.size(), 95u);
  for (const StripePeak& peak : detection.peaks) {
    EXPECT_LT(std::abs(peak.position - (40 + 0.8 * peak.column)), 0.6) << peak.column;
    EXPECT_TRUE(peak.column >= 59 && peak.column <= 161) << peak.column;
  }
}

TEST(StripeStrangers, AnEdgeOfTheArmMovedSinceTheDarkImageIsNoStripe) {
  for (const double grey : {15.0, 30.0, 60.0}) {
    GeneratedStripe stripe, arm;
    stripe.row = [](int x) { return x < 60 ? NAN : 120 + 0.05 * x; };
    stripe.bgr = {0.2, 1, 0.1};
    stripe.peak = 2000;  // clipped to nearly white
    arm.row = [](int x) { return x < 12 ? 60 - 0.5 * x : NAN; };
    arm.bgr = {1, 1, 0.8};
    arm.peak = grey;
    const cv::Mat dark = dark_of(stripe);
    const StripeDetection detection = detect_stripe(cv::max(stripe.image(), arm.image()), dark, columns(10));
    EXPECT_GE(detection.peaks.size(), 175u);
    for (const StripePeak& peak : detection.peaks) EXPECT_GE(peak.column, 60) << "grey " << grey;
    EXPECT_GT(detection.statistics.isolated, 0u) << "grey " << grey;

    arm.bgr = stripe.bgr = GeneratedStripe{}.bgr;  // a piece of the stripe itself, on a small surface
    arm.peak = 2 * grey;
    stripe.peak = GeneratedStripe{}.peak;
    const StripeDetection own = detect_stripe(cv::max(stripe.image(), arm.image()), dark, columns(10));
    EXPECT_GE(std::count_if(own.peaks.begin(), own.peaks.end(), [](const auto& peak) { return peak.column < 12; }), 8)
        << "grey " << grey;
  }
}

/// On a bright object the halo clips in the laser's own channel: beside the core only the other channels rise.
TEST(StripeStrangers, APieceInAHaloThatClipsIsTheStripes) {
  GeneratedStripe wall, core, halo;
  wall.bgr = core.bgr = halo.bgr = {0.3, 0.25, 1};
  wall.noise = core.noise = halo.noise = 1.5;
  wall.sd = 2, core.sd = 2.5, halo.sd = 14;
  wall.peak = 300, core.peak = 1500, halo.peak = 520;
  wall.row = [](int x) { return x < 180 ? 120.0 : NAN; };
  core.row = halo.row = [](int x) { return x >= 190 && x < 215 ? 90 + 0.4 * (x - 190) : NAN; };
  core.seed = 2, halo.seed = 3;
  const cv::Mat image = cv::max(wall.image(), cv::max(core.image(), halo.image()));
  const StripeDetection detection = detect_stripe(image, {}, columns(0));
  std::size_t found = 0;
  for (const StripePeak& peak : detection.peaks)
    found += peak.column >= 190 && std::abs(peak.position - core.true_row(static_cast<int>(peak.column))) < 1;
  EXPECT_GE(found, 20u) << "of 25 columns";
}

}  // namespace
}  // namespace tankrig
