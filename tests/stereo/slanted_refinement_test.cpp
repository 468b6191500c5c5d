// The sub-pixel fit on a pair whose disparity is a plane: the errors, and what it says of them.
#include "reconstruction/stereo/slanted_refinement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <random>

namespace tankrig::testing {
namespace {

constexpr int kColumns = 240, kRows = 160;
constexpr double kSmoothingSigmaPx = 0.8;

/// The plane d + a (u - 120) + b (v - 80), and how the right eye's grey follows from the left's.
struct Truth {
  double d = 20, a = 0, b = 0;
  double gain = 1, offset = 0;

  double disparity(double u, double v) const { return d + a * (u - kColumns / 2) + b * (v - kRows / 2); }
  /// The left column that is seen in column `x` of the right image.
  double left_column(double x, double v) const { return (x + disparity(0, v)) / (1 - a); }
};

double texture(double u, double v) {
  return 100 + 8 * std::sin(0.5 * u + 0.4 * v) + 8 * std::sin(0.4 * u - 0.6 * v) + 8 * std::cos(0.23 * u + 0.31 * v);
}

struct FitErrors {
  int fits = 0;
  double mean_px = 0;     ///< of the errors' sizes
  double rms_sigmas = 0;  ///< of the errors over the fit's own sigma
};

FitErrors fit(const Truth& truth, double noise, int radius) {
  constexpr std::uint64_t kSeed = 5;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> gaussian(0, noise);
  cv::Mat1f left(kRows, kColumns), right(kRows, kColumns), coarse(kRows, kColumns);
  for (int v = 0; v < kRows; ++v)
    for (int u = 0; u < kColumns; ++u) {
      left(v, u) = static_cast<float>(texture(u, v) + gaussian(random));
      right(v, u) =
          static_cast<float>(truth.gain * texture(truth.left_column(u, v), v) + truth.offset + gaussian(random));
      coarse(v, u) = static_cast<float>(std::round(16 * truth.disparity(u, v)) / 16);
    }
  cv::GaussianBlur(left, left, {7, 7}, kSmoothingSigmaPx);
  cv::GaussianBlur(right, right, {7, 7}, kSmoothingSigmaPx);
  const cv::Mat1d weights = cv::getGaussianKernel(7, kSmoothingSigmaPx);
  const double energy = std::pow(weights.dot(weights), 2);

  const RefinedDisparity fine = refine_slanted(left, right, coarse, cv::Mat1b(coarse.size(), std::uint8_t(radius)),
                                               cv::Mat1f(coarse.size(), 0.0f), energy);
  FitErrors e;
  for (int v = 20; v < kRows - 20; ++v)
    for (int u = 100; u < kColumns - 20; ++u) {
      if (std::isnan(fine.disparity(v, u))) continue;
      const double error = fine.disparity(v, u) - truth.disparity(u, v);
      ++e.fits;
      e.mean_px += std::abs(error);
      e.rms_sigmas += std::pow(error / fine.sigma(v, u), 2);
    }
  e.mean_px /= e.fits;
  e.rms_sigmas = std::sqrt(e.rms_sigmas / e.fits);
  return e;
}

constexpr int kAll = (kRows - 40) * (kColumns - 120);

TEST(SlantedRefinement, FindsAPlaneWithoutNoiseToAHundredthOfAPixel) {
  for (const int radius : {5, 15}) {
    const FitErrors e = fit({.a = 0.1, .b = -0.1, .gain = 0.6, .offset = 20}, 0, radius);
    EXPECT_EQ(e.fits, kAll);
    EXPECT_LT(e.mean_px, 0.01) << "radius " << radius;
  }
}

TEST(SlantedRefinement, WiderWindowsErrLessUnderNoise) {
  EXPECT_LT(fit({.a = 0.1}, 3, 15).mean_px, 0.5 * fit({.a = 0.1}, 3, 5).mean_px);
}

TEST(SlantedRefinement, KnowsItsErrorsWhateverWindowGainAndSlant) {
  for (const int radius : {5, 15})
    for (const Truth& truth : {Truth{}, Truth{.a = 0.3}, Truth{.gain = 0.5, .offset = 30}}) {
      const FitErrors e = fit(truth, 2, radius);
      const auto which = [&] {
        return ::testing::Message() << "radius " << radius << " a " << truth.a << " gain " << truth.gain;
      };
      EXPECT_GT(e.fits, 0.99 * kAll) << which();
      EXPECT_GT(e.rms_sigmas, 0.85) << which();
      EXPECT_LT(e.rms_sigmas, 1.15) << which();
    }
}

}  // namespace
}  // namespace tankrig::testing
