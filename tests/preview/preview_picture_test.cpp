// A preview's measures on pictures whose truth is known: edges, blocks, stripes.
#include "bench/report/preview_picture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace tankrig {
namespace {

constexpr std::uint32_t kSeed = 20170503;
const cv::Vec3b kMagenta{255, 0, 255};

/// Dark left, bright right, the edge blurred by a Gauss of `sigma` pixels.
cv::Mat edge(double sigma) {
  cv::Mat image(120, 160, CV_8UC1, cv::Scalar(40));
  image.colRange(80, 160).setTo(200);
  if (sigma > 0) cv::GaussianBlur(image, image, {}, sigma);
  return image;
}

/// A bright line, 3 px wide (one standard deviation 1.5 px), at row `row0 + slope * column`, on noisy water.
cv::Mat stripe_image(double row0, double slope, bool colour) {
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::normal_distribution<double> noise(0, 2);
  cv::Mat image(240, 320, colour ? CV_8UC3 : CV_8UC1);
  for (int r = 0; r < image.rows; ++r)
    for (int c = 0; c < image.cols; ++c) {
      const double across = (r - row0 - slope * c) / 1.5;
      const double light = 150 * std::exp(-0.5 * across * across);
      if (colour)
        image.at<cv::Vec3b>(r, c) = {cv::saturate_cast<unsigned char>(50 + noise(random)),
                                     cv::saturate_cast<unsigned char>(45 + light + noise(random)),
                                     cv::saturate_cast<unsigned char>(10 + 0.1 * light + noise(random))};
      else
        image.at<unsigned char>(r, c) = cv::saturate_cast<unsigned char>(45 + light + noise(random));
    }
  return image;
}

int magenta_pixels(const cv::Mat& picture) {
  cv::Mat mask;
  cv::inRange(picture, cv::Scalar(255, 0, 255), cv::Scalar(255, 0, 255), mask);
  return cv::countNonZero(mask);
}

TEST(Focus, FallsWithEveryBlurOfAnEdge) {
  double sharper = focus_of(edge(0));
  for (const double sigma : {0.8, 1.2, 2.0, 4.0}) {
    const double blurred = focus_of(edge(sigma));
    EXPECT_LT(blurred, 0.8 * sharper) << sigma;
    sharper = blurred;
  }
}

TEST(Focus, IsNothingOnAFlatPictureAndDoesNotSeeBrightness) {
  EXPECT_EQ(focus_of(cv::Mat(50, 50, CV_8UC1, cv::Scalar(77))), 0);
  EXPECT_NEAR(focus_of(edge(1) + 30), focus_of(edge(1)), 1e-9);
}

TEST(Focus, IsTheSameOfAGreyPictureInColour) {
  cv::Mat colour;
  cv::cvtColor(edge(1), colour, cv::COLOR_GRAY2BGR);
  EXPECT_NEAR(focus_of(colour), focus_of(edge(1)), 1e-9);
}

TEST(Clipping, CountsASaturatedBlockExactly) {
  cv::Mat image(100, 100, CV_8UC1, cv::Scalar(254));
  image(cv::Rect(10, 20, 7, 5)).setTo(255);
  const cv::Mat1b mask = clipped_mask(image);
  EXPECT_EQ(cv::countNonZero(mask), 35);
  EXPECT_EQ(cv::countNonZero(mask(cv::Rect(10, 20, 7, 5))), 35);
}

TEST(Clipping, OneChannelAtFullScaleIsEnough) {
  cv::Mat image(40, 60, CV_8UC3, cv::Scalar(10, 254, 254));
  image(cv::Rect(5, 5, 4, 3)).setTo(cv::Scalar(255, 0, 0));
  image(cv::Rect(20, 5, 2, 2)).setTo(cv::Scalar(0, 255, 0));
  image(cv::Rect(30, 5, 1, 1)).setTo(cv::Scalar(0, 0, 255));
  EXPECT_EQ(cv::countNonZero(clipped_mask(image)), 12 + 4 + 1);
}

TEST(Histogram, CountsEveryPixelOfEveryChannelOnce) {
  cv::Mat image(10, 10, CV_8UC3, cv::Scalar(1, 2, 3));
  image(cv::Rect(0, 0, 3, 2)).setTo(cv::Scalar(255, 0, 3));
  const auto sut = histograms_of(image);
  ASSERT_EQ(sut.size(), 3u);
  EXPECT_EQ(sut[0][1], 94);
  EXPECT_EQ(sut[0][255], 6);
  EXPECT_EQ(sut[1][2], 94);
  EXPECT_EQ(sut[1][0], 6);
  EXPECT_EQ(sut[2][3], 100);
}

TEST(Histogram, DoesNotMindAPictureThatIsPartOfALargerOne) {
  cv::Mat image(20, 20, CV_8UC1, cv::Scalar(9));
  image(cv::Rect(5, 5, 4, 4)).setTo(7);
  const auto sut = histograms_of(image(cv::Rect(5, 5, 4, 4)));
  EXPECT_EQ(sut[0][7], 16);
  EXPECT_EQ(sut[0][9], 0);
}

TEST(StripePoints, LieOnADrawnStripeToATenthOfAPixel) {
  for (const bool colour : {false, true}) {
    const auto points = stripe_points(stripe_image(90.3, 0.12, colour), {});
    ASSERT_GT(points.size(), 280u) << colour;
    for (const Vector2d& p : points) EXPECT_NEAR(p.y(), 90.3 + 0.12 * p.x(), 0.1) << p.x();
  }
}

TEST(StripePoints, OfAnUprightStripeAreColumnsAndRowsNotSwapped) {
  const cv::Mat image = stripe_image(90.3, 0.12, false).t();
  const auto points = stripe_points(image, {});
  ASSERT_GT(points.size(), 280u);
  for (const Vector2d& p : points) EXPECT_NEAR(p.x(), 90.3 + 0.12 * p.y(), 0.1) << p.y();
}

TEST(StripePoints, ABrightLineOfTheSceneIsNoStripeWhereTheBackgroundHasIt) {
  cv::Mat background = stripe_image(200, 0, false);
  cv::Mat frame = stripe_image(90.3, 0.12, false);
  frame = cv::max(frame, background);
  const auto points = stripe_points(frame, background);
  ASSERT_GT(points.size(), 250u);
  for (const Vector2d& p : points) EXPECT_NEAR(p.y(), 90.3 + 0.12 * p.x(), 0.2) << p.x();
}

TEST(PreviewPicture, MarksExactlyTheClippedPixelsInTheFrame) {
  cv::Mat frame(480, 640, CV_8UC1, cv::Scalar(100));
  frame(cv::Rect(100, 50, 20, 10)).setTo(255);
  const cv::Mat picture = preview_picture(frame, {});
  ASSERT_EQ(picture.type(), CV_8UC3);
  ASSERT_EQ(picture.cols, 640);
  ASSERT_GT(picture.rows, 480);
  EXPECT_EQ(magenta_pixels(picture.rowRange(0, 480)), 200);
  EXPECT_EQ(picture.at<cv::Vec3b>(50, 100), kMagenta);
  EXPECT_EQ(picture.at<cv::Vec3b>(49, 100), cv::Vec3b(100, 100, 100));
}

TEST(PreviewPicture, PutsADotAtEveryStripePoint) {
  const cv::Mat frame(480, 640, CV_8UC3, cv::Scalar(30, 30, 30));
  PreviewMarks marks;
  marks.laser = true;
  for (int column = 20; column < 620; ++column) marks.stripe.emplace_back(column, 200.0);
  const cv::Mat picture = preview_picture(frame, marks);
  int red = 0;
  for (int column = 20; column < 620; ++column) red += picture.at<cv::Vec3b>(200, column)[2] > 150;
  EXPECT_GT(red, 590);
  EXPECT_EQ(picture.at<cv::Vec3b>(190, 30), cv::Vec3b(30, 30, 30));
}

TEST(PreviewPicture, EnlargesANarrowFrameByAWholeNumberWithoutInventingValues) {
  cv::Mat frame(24, 32, CV_8UC1, cv::Scalar(10));
  frame.at<unsigned char>(3, 5) = 90;
  const cv::Mat picture = preview_picture(frame, {});
  ASSERT_EQ(picture.cols, 640);
  cv::Mat bright;
  cv::inRange(picture.rowRange(0, 480), cv::Scalar::all(90), cv::Scalar::all(90), bright);
  EXPECT_EQ(cv::countNonZero(bright), 400);
  EXPECT_EQ(picture.at<cv::Vec3b>(60, 100), cv::Vec3b(90, 90, 90));
}

TEST(PreviewPicture, FillsTheFocusBarInProportionToTheBest) {
  const cv::Mat frame(480, 640, CV_8UC1, cv::Scalar(100));
  const auto filled = [&](double focus, double best) {
    PreviewMarks marks;
    marks.focus = focus;
    marks.best_focus = best;
    cv::Mat mask;
    cv::inRange(preview_picture(frame, marks), cv::Scalar(80, 200, 80), cv::Scalar(80, 200, 80), mask);
    return cv::countNonZero(mask);
  };
  const int full = filled(7, 7);
  EXPECT_GT(full, 1000);
  EXPECT_NEAR(filled(3.5, 7), full / 2, full / 50);
  EXPECT_EQ(filled(0, 0), 0);
}

}  // namespace
}  // namespace tankrig
