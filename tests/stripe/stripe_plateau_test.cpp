// Stripes so bright that the image shows a clipped plateau instead of a peak.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <opencv2/core.hpp>

#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

struct Overexposed {
  double peak, sd;  ///< [DN], [px]

  /// Of the clipped plateau [px], above a background of 30 DN.
  double plateau() const { return 2 * sd * std::sqrt(2 * std::log(peak / 225)); }
};

constexpr Overexposed kStripes[] = {{600, 2.6},  {1500, 1.9}, {1500, 2.0}, {1000, 2.2}, {800, 3.0}, {300, 8.0},
                                    {1500, 2.6}, {1500, 3.0}, {3000, 3.0}, {3000, 4.5}, {3000, 5.0}};

GeneratedStripe generated(const Overexposed& overexposed, bool white, double noise, unsigned seed) {
  GeneratedStripe stripe;
  stripe.width = 320;
  stripe.height = 240;
  stripe.peak = overexposed.peak;
  stripe.sd = overexposed.sd;
  stripe.bgr = white ? Eigen::Vector3d{1, 1, 1} : Eigen::Vector3d{0, 0, 1};
  stripe.noise = noise;
  stripe.seed = seed;
  stripe.scene = [](int x, int y) { return 30 + 0.03 * x - 0.02 * y; };
  return stripe;
}

struct PlateauErrors {
  double mean = 0, rms = 0, worst = 0, worst_normalised = 0;
};

PlateauErrors plateau_errors(const StripeDetection& detection, const GeneratedStripe& truth) {
  PlateauErrors e;
  for (const StripePeak& peak : detection.peaks) {
    const double error = peak.position - truth.true_row(static_cast<int>(peak.column));
    e.mean += error / static_cast<double>(detection.peaks.size());
    e.rms += error * error / static_cast<double>(detection.peaks.size());
    e.worst = std::max(e.worst, std::abs(error));
    e.worst_normalised = std::max(e.worst_normalised, std::abs(error) / peak.sigma_px);
  }
  e.rms = std::sqrt(e.rms);
  return e;
}

TEST(StripePlateau, OfUpToTwentyPixelsIsCentredWithAnHonestSigma) {
  unsigned seed = 20;
  for (const Overexposed& overexposed : kStripes)
    for (const bool white : {true, false})
      for (const bool rows : {true, false})
        for (const bool with_dark : {true, false})
          for (const double noise : {0.0, 2.0, 5.0}) {
            const GeneratedStripe stripe = generated(overexposed, white, noise, ++seed);
            GeneratedStripe unlit = stripe;
            unlit.laser = false;
            unlit.seed = seed + 1000;
            cv::Mat image = stripe.image(), dark = with_dark ? unlit.image() : cv::Mat();
            if (rows) {
              cv::transpose(image, image);
              if (with_dark) cv::transpose(dark, dark);
            }
            StripeParameters p;
            p.smoothing_px = 0;
            const StripeDetection detection = detect_stripe(image, dark, p);
            const PlateauErrors e = plateau_errors(detection, stripe);
            SCOPED_TRACE(testing::Message() << "peak " << overexposed.peak << " sd " << overexposed.sd << " plateau "
                                            << overexposed.plateau() << " white " << white << " rows " << rows
                                            << " dark " << with_dark << " noise " << noise << " seed " << seed);
            if (rows && white && with_dark)
              std::cout << "plateau " << overexposed.plateau() << " px, noise " << noise << " DN: bias " << e.mean
                        << " rms " << e.rms << " px, worst over sigma " << e.worst_normalised << ", "
                        << detection.peaks.size() << " of " << stripe.width << " columns\n";
            EXPECT_EQ(detection.orientation, rows ? StripeOrientation::kRows : StripeOrientation::kColumns);
            EXPECT_GE(detection.peaks.size(), 0.97 * stripe.width);
            EXPECT_LT(std::abs(e.mean), 0.05);
            EXPECT_LT(e.rms, 0.1);
            EXPECT_LT(e.worst, 0.5);
            EXPECT_LT(e.worst_normalised, 7);
          }
}

/// Found without a dark image, nearly whole and where it is.
void expect_found(const GeneratedStripe& stripe, const cv::Mat& image, const char* name) {
  const StripeDetection detection = detect_stripe(image, {}, {});
  const PlateauErrors e = plateau_errors(detection, stripe);
  std::cout << name << ": bias " << e.mean << " rms " << e.rms << " px, " << detection.peaks.size() << " of "
            << stripe.width << " columns, seed " << stripe.seed << "\n";
  EXPECT_GE(detection.peaks.size(), 0.97 * stripe.width) << name << ", seed " << stripe.seed;
  EXPECT_LT(e.rms, 0.05) << name << ", seed " << stripe.seed;
}

/// The laser's light spread in the water, or in the lens, more to one side of the stripe: in its own colour it clips, too.
void add_haze(cv::Mat& image, const GeneratedStripe& stripe) {
  constexpr double kPeak = 500, kSd = 14, kBeside = 6;
  for (int x = 0; x < image.cols; ++x)
    for (int y = 0; y < image.rows; ++y) {
      const double t = (y - stripe.true_row(x) - kBeside) / kSd;
      cv::Vec3b& pixel = image.at<cv::Vec3b>(y, x);
      const double light[3] = {0.1, 0.1, 1};
      for (int c = 0; c < 3; ++c)
        pixel[c] = cv::saturate_cast<std::uint8_t>(pixel[c] + light[c] * kPeak * std::exp(-0.5 * t * t));
    }
}

TEST(StripePlateau, IsTheWhiteCoreNotTheHazeThatClipsAroundIt) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    GeneratedStripe stripe = generated({2000, 2.5}, false, 2, seed);
    stripe.bgr = {0.3, 0.3, 1};
    cv::Mat image = stripe.image();
    add_haze(image, stripe);
    expect_found(stripe, image, "in haze");
  }
}

/// A core whose red clips and whose other channels show as much as a camera's colour filters let through, in a broad red
/// skirt, as in photographs of bright stripes on dark walls; with a faint reflection beside it.
cv::Mat in_red_skirt(const GeneratedStripe& stripe) {
  cv::Mat image = stripe.image();
  for (int x = 0; x < image.cols; ++x)
    for (int y = 0; y < image.rows; ++y) {
      const double t = y - stripe.true_row(x);
      std::uint8_t& red = image.at<cv::Vec3b>(y, x)[2];
      red = cv::saturate_cast<std::uint8_t>(red + 90 / (1 + std::exp(4 * (std::abs(t) - 6))) +
                                            50 * std::exp(-0.5 * std::pow((t + 14) / 3, 2)));
    }
  return image;
}

TEST(StripePlateau, IsToldByTheChannelThatDoesNotClip) {
  for (const bool rows : {false, true})
    for (unsigned seed = 1; seed <= 5; ++seed) {
      GeneratedStripe stripe = generated({900, 1.3}, false, 2, seed);
      stripe.bgr = {0.22, 0.20, 1};
      cv::Mat image = in_red_skirt(stripe);
      if (rows) cv::transpose(image, image);
      expect_found(stripe, image, "red clips");
    }
}

}  // namespace
}  // namespace tankrig
