// Rectified rows, disparities and points against the cameras themselves; and the average over time.
#include "reconstruction/stereo/rectifier.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include "reconstruction/stereo/temporal_mean.hpp"
#include "tests/stereo/textured_scene.hpp"

namespace tankrig::testing {
namespace {

TEST(Rectifier, PutsAPointWhereTheLeftCameraSeesIt) {
  const StereoCalibration calibration = laboratory_pair(640, 480);
  const Rectifier sut(calibration);
  for (int v = 20; v < 480; v += 55) {
    for (int u = 20; u < 640; u += 60) {
      const Vector3d p = sut.point(u, v, 70.0);
      const auto seen = calibration.left.project(p);
      ASSERT_TRUE(seen);
      EXPECT_LT((*seen - sut.raw_left(u, v)).norm(), 1e-3);
      EXPECT_LT((sut.project(p) - Vector3d(u, v, 70.0)).norm(), 1e-9);
    }
  }
}

/// A point source, as an eye sees it.
cv::Mat1f spot(cv::Size size, const Vector2d& at) {
  cv::Mat1f image(size);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u)
      image(v, u) = static_cast<float>(200 * std::exp(-0.5 * (Vector2d(u, v) - at).squaredNorm() / 9.0));
  return image;
}

Vector2d centroid(const cv::Mat1f& image) {
  Vector2d sum = Vector2d::Zero();
  double weight = 0;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      if (!std::isnan(image(v, u)) && image(v, u) > 2) {
        sum += image(v, u) * Vector2d(u, v);
        weight += image(v, u);
      }
  return sum / weight;
}

TEST(Rectifier, LaysBothEyesOnTheSameRow) {
  // A point source rendered into both raw images must come out at (u, v) and (u - d, v).
  const StereoCalibration calibration = laboratory_pair(400, 300);
  const Rectifier sut(calibration);
  for (const Vector3d& p : {Vector3d(0.02, 0.01, 0.9), Vector3d(0.12, -0.1, 1.1), Vector3d(-0.05, 0.12, 1.0)}) {
    const Vector3d truth = sut.project(p);
    const Vector2d left = centroid(sut.left_fine(spot(sut.size(), *calibration.left.project(p))));
    const Vector2d right = centroid(sut.right_fine(spot(sut.size(), *calibration.right.project(calibration.rMc * p))));
    EXPECT_NEAR(left.x(), truth.x(), 0.02);
    EXPECT_NEAR(left.y(), truth.y(), 0.02);
    EXPECT_NEAR(right.y(), truth.y(), 0.02);
    EXPECT_NEAR(left.x() - right.x(), truth.z(), 0.02);
  }
}

StereoCalibration pair_behind_ports() {
  StereoCalibration calibration = laboratory_pair(640, 480);
  calibration.left.port = FlatPort{0.050, 0.010, Vector3d(0.02, -0.01, 1).normalized()};
  calibration.right.port = FlatPort{0.045, 0.010, Vector3d(-0.015, 0.02, 1).normalized()};
  return calibration;
}

TEST(Rectifier, BehindFlatPortsPlacesAPointWhereBothCamerasSeeIt) {
  const StereoCalibration calibration = pair_behind_ports();
  const Rectifier sut(calibration);
  double worst = 0;
  for (const double depth : {0.5, 0.7, 1.0, 1.4, 2.0}) {
    EXPECT_NEAR(sut.depth(sut.disparity(depth)), depth, 2e-4 * depth);
    for (const Vector2d& at : {Vector2d(0.05, 0), Vector2d(0.2, 0.15), Vector2d(-0.05, -0.15), Vector2d(0.15, -0.1)}) {
      const Vector3d p = depth * at.homogeneous(), truth = sut.project(p);
      const Vector2d left = *calibration.left.project(p), right = *calibration.right.project(calibration.rMc * p);
      if (!calibration.left.contains(left) || !calibration.right.contains(right)) continue;
      EXPECT_LT((sut.point(truth.x(), truth.y(), truth.z()) - p).norm(), 3e-4 * depth) << p.transpose();
      const Vector2d l = centroid(sut.left_fine(spot(sut.size(), left))),
                     r = centroid(sut.right_fine(spot(sut.size(), right)));
      EXPECT_LT((l - truth.head<2>()).norm(), 0.03);
      EXPECT_NEAR(l.x() - r.x(), truth.z(), 0.03);
      worst = std::max(worst, std::abs(l.y() - r.y()));
    }
  }
  std::cout << "rows disagree by " << worst << " px at most, 0.5 to 2 m off\n";
  EXPECT_LT(worst, 0.25);
}

TEST(TemporalMean, MeasuresTheNoiseAndAveragesItAway) {
  constexpr std::uint64_t kSeed = 3;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(0, 6);
  std::vector<cv::Mat1b> images;
  for (int i = 0; i < 16; ++i) {
    cv::Mat1b image(64, 80);
    for (std::uint8_t& g : image) g = cv::saturate_cast<std::uint8_t>(100.3 + noise(random));
    images.push_back(image);
  }
  const TemporalMean sut = temporal_mean(images);
  EXPECT_NEAR(sut.noise, 6, 0.3);
  EXPECT_NEAR(cv::mean(sut.mean)[0], 100.3, 0.1);
  EXPECT_NEAR(std::sqrt(cv::mean(sut.variance)[0]), 6 / 4.0, 0.15);
  cv::Scalar mean, sd;
  cv::meanStdDev(sut.mean, mean, sd);
  EXPECT_NEAR(sd[0], 6 / 4.0, 0.2);
}

TEST(TemporalMean, LeavesOutWhatPassesThrough) {
  std::vector<cv::Mat1b> images;
  for (int i = 0; i < 9; ++i) {
    cv::Mat1b image(32, 90, std::uint8_t{50});
    image(cv::Rect(10 * i, 5, 10, 10)) = 250;
    images.push_back(image);
  }
  const TemporalMean sut = temporal_mean(images);
  for (const float grey : sut.mean) EXPECT_EQ(grey, 50);
  EXPECT_LT(sut.noise, 1.0);
}

TEST(TemporalMean, ReadsTheNoiseOfASingleImageOffItsSmoothParts) {
  constexpr std::uint64_t kSeed = 4;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(0, 5);
  cv::Mat1b image(200, 200);
  for (int v = 0; v < 200; ++v)
    for (int u = 0; u < 200; ++u) {
      const double scene = u < 100 ? 90 : 90 + 60 * std::sin(u * 1.3) * std::cos(v * 0.9);
      image(v, u) = cv::saturate_cast<std::uint8_t>(scene + noise(random));
    }
  EXPECT_NEAR(temporal_mean({image}).noise, 5, 0.8);
}

}  // namespace
}  // namespace tankrig::testing
