// The reference module's arithmetic, against figures worked out by hand from its rules.
#include "bench/metrics/uwsim_metrics.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "bench/metrics/metrics.hpp"
#include "core/input_error.hpp"
#include "tests/metrics/shapes.hpp"

namespace tankrig {
namespace {

/// Every lattice node of the given faces (axis, side) of the 140 x 300 x 160 mm box: 15 x 30 x 17 nodes.
PointCloud nodes(std::initializer_list<std::pair<int, int>> faces) {
  const int size[3] = {15, 30, 17};
  const double step[3] = {0.01, 0.01 + 0.01 / 30, 0.01};
  PointCloud cloud;
  for (const auto& [axis, side] : faces)
    for (int i = 0; i < size[0]; ++i)
      for (int j = 0; j < size[1]; ++j)
        for (int k = 0; k < size[2]; ++k) {
          const int node[3] = {i, j, k};
          if (node[axis] != (side ? size[axis] - 1 : 0)) continue;
          Vector3d p;
          for (int a = 0; a < 3; ++a) p[a] = shapes::kBoxLow[a] + step[a] * node[a];
          cloud.points.emplace_back().p = p;
        }
  return cloud;
}

UwsimMetrics score(const PointCloud& cloud) { return uwsim_metrics(cloud, shapes::tank_box(), 0.01); }

TEST(UwsimMetrics, CountTheLatticeLikeTheReference) {
  const UwsimMetrics m = score({});
  EXPECT_EQ(m.lattice, (std::array<int, 3>{15, 30, 17}));
  EXPECT_EQ(m.denominator, 1995);
}

TEST(UwsimMetrics, OfATopAndFourSidesReadNinetyOnePointFivePercent) {
  const UwsimMetrics m = score(nodes({{2, 1}, {0, 0}, {0, 1}, {1, 0}, {1, 1}}));
  EXPECT_EQ(m.marked_nodes, 1826);
  EXPECT_NEAR(m.coverage, 0.915, 0.0005);
}

TEST(UwsimMetrics, OfSingleFacesReadTheReferencesShares) {
  EXPECT_NEAR(score(nodes({{2, 1}})).coverage, 0.226, 0.0005);
  EXPECT_NEAR(score(nodes({{2, 1}, {0, 1}})).coverage, 0.466, 0.0005);
  EXPECT_NEAR(score(nodes({{2, 1}, {1, 0}})).coverage, 0.346, 0.0005);
  EXPECT_NEAR(score(nodes({{2, 1}, {0, 1}, {1, 0}})).coverage, 0.578, 0.0005);
}

TEST(UwsimMetrics, AreTheSameForAMeshStoredInSinglePrecision) {
  TriangleMesh single = shapes::tank_box();
  for (Vector3d& v : single.vertices) v = v.cast<float>().cast<double>();
  EXPECT_EQ(uwsim_metrics({}, single).denominator, 1995);
}

TEST(UwsimMetrics, TakeErrorsOfAlmostFifteenCentimetresIntoTheMean) {
  const UwsimMetrics m = score(shapes::cloud_of({{0, 0, 0.149}, {0, 0, 0.049}, {0, 0, 0.151}}));
  EXPECT_EQ(m.inliers, 2u);
  EXPECT_EQ(m.outlier_count, 1u);
  EXPECT_NEAR(m.mean_error_m, 0.099, 1e-12);
  EXPECT_NEAR(m.error_variance_m2, 0.005, 1e-12);
  EXPECT_DOUBLE_EQ(m.outliers, 1.0 / 3.0);
}

TEST(UwsimMetrics, MeasureToTheNearestFacePlaneInside) {
  EXPECT_NEAR(score(shapes::cloud_of({{0.03, 0, -0.06}})).mean_error_m, 0.040, 1e-12);
  EXPECT_NEAR(score(shapes::cloud_of({{0.10, 0.19, 0}})).mean_error_m, 0.050, 1e-12) << "outside, off an edge";
}

/// The same perfect cloud of a sphere, scored on its mesh and on the box around it.
TEST(UwsimMetrics, MeasureToTheBoxWhereThePaperMeasuresToTheMesh) {
  constexpr double kRadius = 0.1;
  const TriangleMesh sphere = shapes::icosphere(kRadius, 5);
  PointCloud cloud = shapes::cloud_of({});
  std::mt19937_64 random(14);
  double to_the_box = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d p = kRadius * shapes::random_unit(random);
    cloud.points.emplace_back().p = p;
    to_the_box += (kRadius - p.cwiseAbs().maxCoeff()) / 20'000;
  }
  const Metrics paper = evaluate(cloud, ObjectSurface(sphere, 20'000), {});
  EXPECT_LT(paper.error->mean, 1e-4);
  EXPECT_NEAR(paper.headline().whole, 1, 1e-9);
  const UwsimMetrics reference = uwsim_metrics(cloud, sphere);
  EXPECT_NEAR(reference.mean_error_m, to_the_box, 1e-3);
  EXPECT_GT(reference.mean_error_m, 0.015);
  EXPECT_LT(reference.coverage, 0.5);
}

TEST(UwsimMetrics, CallGroundWhatIsNearerToTheBottomPlaneUpToTenCentimetres) {
  EXPECT_EQ(score(shapes::cloud_of({{0.17, 0, -0.061}})).ground_points, 1u);
  EXPECT_EQ(score(shapes::cloud_of({{0.50, 0, -0.059}})).ground_points, 0u) << "0.101 m above the plane";
  EXPECT_EQ(score(shapes::cloud_of({{0.16, 0, -0.069}})).ground_points, 0u) << "nearer to the box";
  EXPECT_EQ(score(shapes::cloud_of({{0, 0, -0.159}})).ground_points, 0u) << "as near to the box as to the plane";
}

TEST(UwsimMetrics, MarkTheEightNodesAroundAPoint) {
  EXPECT_EQ(score(shapes::cloud_of({{0.001, 0.001, -0.001}})).marked_nodes, 4) << "of 8, the upper 4 are on the top";
  EXPECT_EQ(score(shapes::cloud_of({{-0.069, -0.149, -0.001}})).marked_nodes, 7)
      << "all but the inner one, at a corner";
  EXPECT_EQ(score(shapes::cloud_of({{0.0, 0.0, -0.05}})).marked_nodes, 0);
}

TEST(UwsimMetrics, OfAnEmptyCloudAreAPerfectScore) {
  const UwsimMetrics m = score({});
  EXPECT_EQ(m.mean_error_m, 0.0);
  EXPECT_EQ(m.outliers, 0.0);
  EXPECT_EQ(m.error_variance_m2, 0.0);
  EXPECT_TRUE(std::signbit(m.error_variance_m2));
  EXPECT_TRUE(std::isnan(score(shapes::cloud_of({{0, 0, 0.001}})).error_variance_m2));
}

TEST(UwsimMetrics, SkipPointsThatAreNotFinite) {
  PointCloud cloud = shapes::cloud_of({{0, 0, 0.001}});
  cloud.points.emplace_back().p = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(score(cloud).inliers, 1u);
}

TEST(UwsimMetrics, RefuseALatticeCoarserThanTheBox) {
  EXPECT_THROW(uwsim_metrics({}, shapes::tank_box(), 0.15), InputError);
}

}  // namespace
}  // namespace tankrig
