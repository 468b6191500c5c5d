// The paper's detector does what the paper says, no more.
#include "reconstruction/stripe/paper_stripe.hpp"

#include <gtest/gtest.h>

#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

TEST(PaperStripe, IsTheHandComputedCentreOfMasses) {
  cv::Mat image(40, 3, CV_8UC3, cv::Scalar(0, 0, 0));
  // Column 1: brightest gated pixel at row 20; masses 30 at 17, 300 at 20, 150 at 22, and 90 at 26, outside the window.
  image.at<cv::Vec3b>(17, 1) = {10, 10, 10};
  image.at<cv::Vec3b>(20, 1) = {20, 240, 40};
  image.at<cv::Vec3b>(22, 1) = {10, 130, 10};
  image.at<cv::Vec3b>(26, 1) = {10, 70, 10};
  // Column 2: a brighter pixel of another hue is outside the gate.
  image.at<cv::Vec3b>(10, 2) = {20, 200, 20};
  image.at<cv::Vec3b>(30, 2) = {255, 10, 255};
  const StripeDetection detection = detect_paper(image, PaperStripeParameters::simulation());
  ASSERT_EQ(detection.peaks.size(), 2u);
  EXPECT_EQ(detection.peaks[0].column, 1);
  EXPECT_NEAR(detection.peaks[0].position, (17 * 30 + 20 * 300 + 22 * 150) / 480.0, 1e-5);
  EXPECT_EQ(detection.peaks[1].position, 10);
  EXPECT_EQ(detection.statistics.no_peak, 1u);
}

TEST(PaperStripe, SearchesRowsWhenTheStripeRunsAlongColumns) {
  GeneratedStripe stripe;
  cv::Mat image = stripe.image(), turned;
  cv::transpose(image, turned);
  PaperStripeParameters p = PaperStripeParameters::simulation();
  p.orientation = StripeOrientation::kColumns;
  const StripeDetection upright = detect_paper(image, p);
  p.orientation = StripeOrientation::kRows;
  const StripeDetection rows = detect_paper(turned, p);
  ASSERT_EQ(upright.peaks.size(), static_cast<std::size_t>(stripe.width));
  ASSERT_EQ(rows.peaks.size(), upright.peaks.size());
  for (std::size_t i = 0; i < rows.peaks.size(); ++i) EXPECT_EQ(rows.peaks[i].position, upright.peaks[i].position);
}

TEST(PaperStripe, FindsNothingOutsideItsGate) {
  GeneratedStripe stripe;
  stripe.peak = 30;  // below the simulation preset's least value of 40
  stripe.scene = [](int, int) { return 5.0; };
  EXPECT_TRUE(detect_paper(stripe.image(), PaperStripeParameters::simulation()).peaks.empty());
  EXPECT_TRUE(detect_paper(stripe.image(), PaperStripeParameters::real()).peaks.empty());
}

}  // namespace
}  // namespace tankrig
