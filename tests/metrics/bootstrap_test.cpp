// Intervals of clouds whose error belongs to their frames.
#include "bench/metrics/bootstrap.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tankrig {
namespace {

/// `frames` frames of ten points each; those of frame k are k + 1 tenths of a millimetre off, one in ten is an outlier.
std::pair<PointCloud, Metrics> frames_with_errors(int frames) {
  PointCloud cloud;
  Metrics metrics;
  for (int k = 0; k < frames; ++k)
    for (int i = 0; i < 10; ++i) {
      CloudPoint point;
      point.frame = k;
      point.p = {0.001 * i, 0.1 * k, 0};
      cloud.points.push_back(point);
      const bool outlier = i == 0;
      metrics.verdicts.push_back(outlier ? PointVerdict::kOutlier : PointVerdict::kObject);
      metrics.distances.push_back(outlier ? 1 : 1e-4 * (k + 1));
    }
  return {std::move(cloud), std::move(metrics)};
}

TEST(Bootstrap, IntervalIsThatOfTheFramesNotOfTheirPoints) {
  const auto [cloud, metrics] = frames_with_errors(40);
  const ErrorIntervals found = bootstrap_errors(cloud, metrics);
  EXPECT_TRUE(found.by_frame);
  EXPECT_EQ(found.groups, 40u);
  ASSERT_TRUE(found.mean && found.outliers);
  const double mean = 1e-4 * 20.5, half = 1.96 * 1e-4 * std::sqrt((40.0 * 40 - 1) / 12 / 40);
  EXPECT_NEAR((*found.mean)[0], mean - half, 0.15 * half);
  EXPECT_NEAR((*found.mean)[1], mean + half, 0.15 * half);
  EXPECT_DOUBLE_EQ((*found.outliers)[0], 0.1);  // the same in every frame: no doubt
  EXPECT_DOUBLE_EQ((*found.outliers)[1], 0.1);
}

TEST(Bootstrap, CutsACloudOfFewFramesIntoBlocks) {
  const auto [cloud, metrics] = frames_with_errors(4);
  const ErrorIntervals found = bootstrap_errors(cloud, metrics);
  EXPECT_FALSE(found.by_frame);
  EXPECT_EQ(found.groups, 4u);  // 0.1 m apart, each 10 mm wide
}

TEST(Bootstrap, HasNothingToSayOfAnEmptyCloud) {
  const ErrorIntervals found = bootstrap_errors({}, {});
  EXPECT_FALSE(found.mean || found.stddev || found.outliers);
}

}  // namespace
}  // namespace tankrig
