// A beam that water scatters to one side: light that decays away from the stripe and draws every fit along.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <opencv2/core.hpp>
#include <vector>

#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

/// exp(-t / length) from the middle of the core on to one side, blurred as the core: summed, and kept at tenths of a pixel.
class BlurredTail {
 public:
  BlurredTail(double sd, double length) {
    for (int i = 0; i <= 2 * kReach * kPerPixel; ++i) {
      double sum = 0;
      for (double u = 0.5 * kStep; u < 8 * length; u += kStep)
        sum +=
            kStep * std::exp(-u / length - 0.5 * std::pow((static_cast<double>(i) / kPerPixel - kReach - u) / sd, 2));
      values_.push_back(sum / (sd * std::sqrt(2 * M_PI)));
    }
  }
  double operator()(double t) const {
    const double at = std::clamp((t + kReach) * kPerPixel, 0.0, static_cast<double>(values_.size()) - 1.001);
    const auto i = static_cast<std::size_t>(at);
    return values_[i] + (at - static_cast<double>(i)) * (values_[i + 1] - values_[i]);
  }

 private:
  static constexpr int kReach = 160, kPerPixel = 10;
  static constexpr double kStep = 0.25;
  std::vector<double> values_;
};

/// Rises within a pixel, sharply from the middle on.
double sharp_tail(double t, double length) { return t > 0 ? (1 - std::exp(-t)) * std::exp(-t / length) : 0; }

GeneratedStripe generated(double sd, double noise, unsigned seed) {
  GeneratedStripe stripe;
  stripe.width = 320;
  stripe.height = 240;
  stripe.peak = 150;
  stripe.sd = sd;
  stripe.noise = noise;
  stripe.seed = seed;
  stripe.row = [](int x) { return 120 + 0.11 * x + 6 * std::sin(x / 60.0); };
  return stripe;
}

struct HazeErrors {
  double mean = 0, over_sigma = 0;  ///< the latter rms
  std::size_t points = 0;
  bool hazy = false;
};

HazeErrors errors_of(const GeneratedStripe& stripe, bool with_dark, bool rows = false) {
  cv::Mat image = stripe.image(), dark;
  if (with_dark) {
    GeneratedStripe unlit = stripe;
    unlit.laser = false;
    unlit.seed += 1000;
    dark = unlit.image();
  }
  if (rows) {
    cv::transpose(image, image);
    if (with_dark) cv::transpose(dark, dark);
  }
  const StripeDetection detection = detect_stripe(image, dark, {});
  HazeErrors e;
  e.hazy = detection.statistics.hazy_frames == 1;
  for (const StripePeak& peak : detection.peaks) {
    const double error = peak.position - stripe.true_row(static_cast<int>(peak.column));
    e.mean += error;
    e.over_sigma += std::pow(error / peak.sigma_px, 2);
    ++e.points;
  }
  e.mean /= static_cast<double>(e.points);
  e.over_sigma = std::sqrt(e.over_sigma / static_cast<double>(e.points));
  return e;
}

TEST(OneSidedHaze, DoesNotDrawTheStripe) {
  unsigned seed = 0;
  for (const double sd : {1.2, 2.0, 4.0})
    for (const double share : {0.05, 0.2, 0.5})
      for (const double length : {2 * sd, 6 * sd})
        for (const int side : {-1, 1})
          for (const bool with_dark : {false, true}) {
            GeneratedStripe stripe = generated(sd, 1.5, ++seed);
            stripe.haze = [=, tail = BlurredTail(sd, length)](double t) { return share * tail(side * t); };
            const HazeErrors e = errors_of(stripe, with_dark, seed % 4 == 0);
            SCOPED_TRACE(testing::Message() << "sd " << sd << " share " << share << " length " << length << " side "
                                            << side << " dark " << with_dark << " seed " << seed);
            EXPECT_EQ(e.points, 320u);
            EXPECT_TRUE(e.hazy || share < 0.1);
            EXPECT_LT(std::abs(e.mean), 0.03);
            EXPECT_LT(e.over_sigma, share < 0.1 ? 2.5 : 1.3);  // what is too weak to be clear stays, within 0.03 px
            std::cout << "haze " << share << " over " << length << " px, sd " << sd << ", side " << side << ": bias "
                      << e.mean << " px, error over sigma " << e.over_sigma << "\n";
          }
}

TEST(OneSidedHaze, OfAnotherShapeIsInTheSigma) {
  unsigned seed = 100;
  for (const double share : {0.1, 0.25, 0.5})
    for (const double length : {4.0, 9.0, 20.0})
      for (const bool with_dark : {false, true}) {
        GeneratedStripe stripe = generated(2, 1.5, ++seed);
        stripe.haze = [=](double t) { return share * sharp_tail(t, length); };
        const HazeErrors e = errors_of(stripe, with_dark);
        SCOPED_TRACE(testing::Message() << "share " << share << " length " << length << " seed " << seed);
        EXPECT_LT(std::abs(e.mean), 0.1);
        EXPECT_LT(e.over_sigma, 1.3);
        std::cout << "sharp haze " << share << " over " << length << " px: bias " << e.mean << " px, error over sigma "
                  << e.over_sigma << "\n";
      }
}

TEST(OneSidedHaze, MayLieOnBothSides) {
  unsigned seed = 200;
  for (const double other : {0.5, 1.0})
    for (const bool with_dark : {false, true}) {
      GeneratedStripe stripe = generated(2, 1.5, ++seed);
      stripe.haze = [=, tail = BlurredTail(2, 9)](double t) { return 0.2 * (tail(t) + other * tail(-t)); };
      const HazeErrors e = errors_of(stripe, with_dark);
      EXPECT_LT(std::abs(e.mean), 0.02) << "seed " << seed;
      EXPECT_LT(e.over_sigma, 1.3) << "seed " << seed;
    }
}

/// A line that the scene is brighter behind: no haze.
TEST(OneSidedHaze, IsNotAnEdgeOfTheScene) {
  unsigned seed = 300;
  for (const bool with_dark : {false, true}) {
    GeneratedStripe stripe = generated(2, 1.5, ++seed);
    stripe.scene = [&](int x, int y) { return y > stripe.true_row(x) + 9 ? 45 : 15; };
    const HazeErrors e = errors_of(stripe, with_dark);
    EXPECT_FALSE(e.hazy) << "seed " << seed;
    EXPECT_LT(std::abs(e.mean), 0.02) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tankrig
