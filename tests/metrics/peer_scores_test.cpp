// Tanks and Temples' and ETH3D's scores on clouds whose scores follow from their definitions by hand.
#include "bench/metrics/peer_scores.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/metrics/shapes.hpp"

namespace tankrig {
namespace {

/// A row of points along x, 20 mm apart: no two share a voxel of either definition.
std::vector<Vector3d> row(int count, const Vector3d& shift = Vector3d::Zero()) {
  std::vector<Vector3d> out;
  for (int i = 0; i < count; ++i) out.push_back(Vector3d(0.02 * i, 0, 0) + shift);
  return out;
}

TEST(TanksAndTemples, CountsSharesBothWaysAndTheirHarmonicMean) {
  std::vector<Vector3d> cloud = row(60, {0, 0.005, 0});
  for (const Vector3d& far : row(20, {0, 1, 0})) cloud.push_back(far);
  const TanksAndTemplesScore score = tanks_and_temples_score(cloud, row(100), 0.010);
  EXPECT_EQ(score.points, 80u);
  EXPECT_EQ(score.truth_points, 100u);
  EXPECT_DOUBLE_EQ(*score.precision, 0.75);
  EXPECT_DOUBLE_EQ(score.recall, 0.6);
  EXPECT_DOUBLE_EQ(score.f, 2 * 0.75 * 0.6 / 1.35);
}

TEST(TanksAndTemples, TakesNearerThanTauAndNotTauItself) {
  EXPECT_EQ(*tanks_and_temples_score({{0, 0, 0.25}}, {{0, 0, 0}}, 0.25).precision, 0);
  EXPECT_EQ(*tanks_and_temples_score({{0, 0, 0.25}}, {{0, 0, 0}}, 0.2500001).precision, 1);
}

TEST(TanksAndTemples, ThinsSoThatACrowdCountsOnce) {
  std::vector<Vector3d> cloud = row(10);
  for (int i = 0; i < 1000; ++i) cloud.emplace_back(5 + 1e-6 * i, 0, 0);  // a crowd of outliers in one voxel
  const TanksAndTemplesScore score = tanks_and_temples_score(cloud, row(10), 0.010);
  EXPECT_EQ(score.points, 11u);
  EXPECT_DOUBLE_EQ(*score.precision, 10.0 / 11);
}

TEST(TanksAndTemples, TakesWhateverIsFinite) {
  std::vector<Vector3d> cloud = row(10);
  cloud.emplace_back(1e300, -1e300, 0);
  EXPECT_DOUBLE_EQ(tanks_and_temples_score(cloud, row(10), 0.010).recall, 1);
  EXPECT_EQ(eth3d_score(cloud, {{{0, 0, 1}, row(10)}}, 0.005).accurate, 10u);
}

TEST(TanksAndTemples, OfAnEmptyCloudIsNoPrecisionAndNothingRecalled) {
  const TanksAndTemplesScore score =
      tanks_and_temples_score({{std::numeric_limits<double>::quiet_NaN(), 0, 0}}, row(10), 0.010);
  EXPECT_FALSE(score.precision);
  EXPECT_EQ(score.recall, 0);
  EXPECT_EQ(score.f, 0);
}

/// A scanner 1 m above the row: beams straight enough that they stay apart.
TruthScan scan_of_row(int count) { return {{0.1, 0, 1}, row(count)}; }

/// Along the scanner's ray through point `i` of the row, `beyond` metres behind it.
Vector3d on_beam(const TruthScan& scan, int i, double beyond) {
  const Vector3d& p = scan.points[static_cast<std::size_t>(i)];
  return p + beyond * (p - scan.from).normalized();
}

TEST(Eth3d, CallsPointsAccurateInaccurateOrUnobserved) {
  const TruthScan scan = scan_of_row(10);
  const std::vector<Vector3d> cloud{on_beam(scan, 0, 0.004), on_beam(scan, 1, -0.004),  // within the tolerance
                                    on_beam(scan, 2, -0.1),                             // in water that was seen
                                    on_beam(scan, 3, 0.1),                              // behind the surface
                                    Vector3d(0.03, 0.01, 0)};                           // in no beam
  const Eth3dScore score = eth3d_score(cloud, {scan}, 0.005);
  EXPECT_EQ(score.accurate, 2u);
  EXPECT_EQ(score.inaccurate, 1u);
  EXPECT_EQ(score.unobserved, 2u);
  EXPECT_NEAR(*score.accuracy, 2.0 / 3, 1e-12);  // each in voxels of its own, in both grids
  EXPECT_NEAR(score.completeness, 0.2, 1e-12);
  EXPECT_NEAR(score.f1, 2 * (2.0 / 3) * 0.2 / (2.0 / 3 + 0.2), 1e-12);
}

TEST(Eth3d, CallsAccurateWhatIsSoInOneScan) {
  const TruthScan above = scan_of_row(10);
  const Vector3d p = on_beam(above, 2, -0.1);
  const TruthScan aside{{0.04, 1, 0.1}, {p}};
  EXPECT_EQ(eth3d_score({p}, {above}, 0.005).inaccurate, 1u);
  EXPECT_EQ(eth3d_score({p}, {above, aside}, 0.005).accurate, 1u);
}

TEST(Eth3d, AveragesOverVoxelsSoThatALonelyPointWeighsAsACrowd) {
  // Nine points in one voxel of either grid, one in another.
  TruthScan scan{{0, 0, 1}, {}};
  for (int i = 0; i < 9; ++i) scan.points.emplace_back(0.0051 + 0.0005 * i, 0.0052, 0.0052);
  scan.points.emplace_back(0.1052, 0.0052, 0.0052);
  EXPECT_NEAR(eth3d_score({scan.points.back()}, {scan}, 0.001).completeness, 0.5, 1e-12);
}

TEST(Eth3d, TakesTheToleranceItselfAsNear) {
  const TruthScan scan{{0, 0, 1}, {{0, 0, 0}}};
  const Eth3dScore score = eth3d_score({{0, 0, 0.25}}, {scan}, 0.25);
  EXPECT_EQ(score.accurate, 1u);
  EXPECT_EQ(score.completeness, 1);
}

TEST(Eth3d, OfAnEmptyCloudIsNoAccuracyAndNothingComplete) {
  const Eth3dScore score = eth3d_score({}, {scan_of_row(10)}, 0.005);
  EXPECT_FALSE(score.accuracy);
  EXPECT_EQ(score.completeness, 0);
  EXPECT_EQ(score.f1, 0);
}

TEST(TruthScan, SeesTheFacesThatAreTurnedToItAndNothingBehindThem) {
  const ObjectSurface object(shapes::tank_box(), 20'000);
  const TruthScan scan = scan_of(object, {0, 0, 1});
  ASSERT_GT(scan.points.size(), 1000u);
  for (const Vector3d& p : scan.points) EXPECT_NEAR(p.z(), 0, 1e-12);
  double share = 0;
  for (const SurfaceSample& sample : object.samples()) share += sample.p.z() > -1e-12 ? 1 : 0;
  EXPECT_EQ(scan.points.size(), static_cast<std::size_t>(share));  // all of the top face
}

TEST(PeerScores, OfAPerfectCloudAreOneAndOfAShiftedOneFallWithTheTolerance) {
  const ObjectSurface object(shapes::tank_box(), 20'000);
  const TruthScan scan = scan_of(object, {0, 0, 1});
  std::vector<Vector3d> shifted;
  for (const Vector3d& p : scan.points) shifted.push_back(p + Vector3d(0, 0, 0.004));
  EXPECT_EQ(tanks_and_temples_score(scan.points, scan.points, 0.002).f, 1);
  EXPECT_EQ(eth3d_score(scan.points, {scan}, 0.002).f1, 1);
  EXPECT_EQ(tanks_and_temples_score(shifted, scan.points, 0.0039).f, 0);
  EXPECT_EQ(eth3d_score(shifted, {scan}, 0.0039).f1, 0);
  EXPECT_EQ(eth3d_score(shifted, {scan}, 0.0039).accurate, 0u);
  EXPECT_GT(tanks_and_temples_score(shifted, scan.points, 0.006).f, 0.99);
  EXPECT_GT(eth3d_score(shifted, {scan}, 0.006).f1, 0.99);
}

}  // namespace
}  // namespace tankrig
