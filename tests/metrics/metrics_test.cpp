// The paper's figures on clouds whose answers are known.
#include "bench/metrics/metrics.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "tests/metrics/shapes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using shapes::kBoxHigh;
using shapes::kBoxLow;

MetricThresholds without_ground() {
  MetricThresholds t;
  t.ground_band_m = 0;
  return t;
}

const ObjectSurface& tank_box() {
  static const ObjectSurface object(shapes::tank_box());
  return object;
}

PointCloud faces(std::initializer_list<std::pair<int, int>> axis_and_side, double step = 0.0005) {
  PointCloud cloud;
  cloud.frame = "o";
  for (const auto& [axis, side] : axis_and_side) shapes::append_face(cloud, kBoxLow, kBoxHigh, axis, side, step);
  return cloud;
}

TEST(Coverage, OfThreePerfectBoxFacesGrowsWithTheThresholdAsTheoryPredicts) {
  MetricThresholds thresholds = without_ground();
  thresholds.inlier_m = thresholds.outlier_m = 0.020;
  thresholds.coverage_m = {0.001, 0.002, 0.005, 0.010, 0.020};
  const Metrics m = evaluate(faces({{0, 1}, {1, 1}, {2, 1}}), tank_box(), thresholds);
  const Vector3d edges = kBoxHigh - kBoxLow;
  ASSERT_EQ(m.coverage.size(), 5u);
  for (const Coverage& c : m.coverage) {
    const double t = c.threshold_m;
    const double expected = 0.5 + (2 * t * edges.sum() - 3 * t * t) / tank_box().mesh().area();
    // The grid's own gaps: a point of the surface is at most half a cell's diagonal, 0.36 mm, from the cloud, which
    // shortens the reach past an edge by at most sqrt(t^2 - 0.25^2) - t.
    const double shortened = (t - std::sqrt(t * t - 0.00025 * 0.00025)) * 2 * edges.sum() / tank_box().mesh().area();
    EXPECT_NEAR(c.whole, expected, 4 * c.whole_sigma + shortened) << "t = " << t;
    EXPECT_LT(c.whole_sigma, 5e-4);
    EXPECT_GT(c.whole_sigma, 1e-5);
  }
  EXPECT_NEAR(m.coverage[3].whole, 0.5520, 5e-4);
}

TEST(Coverage, OfTheNamedFacesIsTheTableOfThePaper) {
  MetricThresholds thresholds = without_ground();
  thresholds.coverage_m = {0.0004};
  thresholds.coverage_headline_m = 0.0004;
  const double spill = 2 * 0.0004 * 0.6 / 0.2248;
  EXPECT_NEAR(evaluate(faces({{2, 1}}), tank_box(), thresholds).headline().whole, 0.1868, spill);
  EXPECT_NEAR(evaluate(faces({{2, 1}, {0, 1}}), tank_box(), thresholds).headline().whole, 0.4004, spill);
  EXPECT_NEAR(evaluate(faces({{2, 1}, {1, 0}}), tank_box(), thresholds).headline().whole, 0.2865, spill);
}

TEST(Coverage, OfAllSixFacesIsEverything) {
  const Metrics m =
      evaluate(faces({{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}}, 0.001), tank_box(), without_ground());
  for (const Coverage& c : m.coverage) {
    EXPECT_DOUBLE_EQ(c.whole, 1.0);
    EXPECT_DOUBLE_EQ(c.whole_sigma, 0.0);
  }
  EXPECT_NEAR(m.error->mean, 0.0, 1e-12);
}

TEST(Coverage, StatesTheSpreadOverSampleSetsAsItsSamplingError) {
  std::vector<double> found;
  double stated = 0;
  constexpr int kSets = 60;
  const PointCloud cloud = faces({{2, 1}, {0, 1}}, 0.002);
  for (int set = 0; set < kSets; ++set) {
    TriangleMesh mesh = shapes::tank_box();  // starting at another triangle gives every patch another point
    std::rotate(mesh.triangles.begin(), mesh.triangles.begin() + set % 12, mesh.triangles.end());
    const ObjectSurface object(mesh, 9000 + 400 * (set / 12));
    MetricThresholds t = without_ground();
    t.coverage_m = {t.coverage_headline_m = 0.010};
    const Metrics m = evaluate(cloud, object, t);
    found.push_back(m.headline().whole);
    stated += m.headline().whole_sigma / kSets;
  }
  double mean = 0, variance = 0;
  for (double c : found) mean += c / kSets;
  for (double c : found) variance += (c - mean) * (c - mean) / (kSets - 1);
  EXPECT_LT(std::sqrt(variance), 1.3 * stated);
  EXPECT_GT(std::sqrt(variance), 0.3 * stated);
}

TEST(SurfaceSamples, HaveTheSurfaceAsTheirWeightWhateverTheTriangles) {
  TriangleMesh slivers = shapes::tank_box();
  slivers.vertices.push_back({0.0699, 0.15, 0});
  slivers.triangles[10] = {4, 5, 8};
  for (const TriangleMesh& mesh : {shapes::tank_box(), shapes::icosphere(0.1, 4), slivers}) {
    const auto samples = sample_surface(mesh, 200'000);
    double sum = 0;
    for (const SurfaceSample& s : samples) sum += s.weight;
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_GT(samples.size(), 130'000u);
    EXPECT_LT(samples.size(), 320'000u);
  }
}

TEST(ErrorFigures, OfAPlaneOffsetAreTheOffset) {
  const ObjectSurface plane(shapes::square(0.5), 20'000);
  std::vector<Vector3d> points;
  for (int i = 0; i < 100; ++i) points.push_back({-0.4 + 0.008 * i, 0.1, i % 2 ? 0.003 : -0.005});
  const Metrics m = evaluate(shapes::cloud_of(points), plane, without_ground());
  ASSERT_TRUE(m.error);
  EXPECT_NEAR(m.error->mean, 0.004, 1e-12);
  EXPECT_NEAR(m.error->median, 0.004, 1e-12);
  EXPECT_NEAR(m.error->rms, std::sqrt((9e-6 + 25e-6) / 2), 1e-12);
  EXPECT_NEAR(*m.error->stddev, 0.001 * std::sqrt(100.0 / 99.0), 1e-12);
  EXPECT_NEAR(*m.error->mean_sigma, *m.error->stddev / 10, 1e-15);
  EXPECT_NEAR(m.error->p95, 0.005, 1e-12);
  EXPECT_FALSE(m.error->bias) << "an open plane has no inside";
}

TEST(ErrorFigures, OfNoisyPointsOnASphereAreTheNoise) {
  constexpr double kRadius = 0.1, kBias = -0.002, kSigma = 0.0008;
  constexpr unsigned kSeed = 11;
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(kBias, kSigma);
  std::vector<Vector3d> points;
  for (int i = 0; i < 20'000; ++i) points.push_back((kRadius + noise(random)) * shapes::random_unit(random));
  const ObjectSurface sphere(shapes::icosphere(kRadius, 6), 20'000);
  // The mean of the sagitta is a little under its largest value, edge^2 / (6 r).
  const double edge = 1.0515 * kRadius / 64 * 1.1;
  const double sagitta = edge * edge / (6 * kRadius);
  const Metrics m = evaluate(shapes::cloud_of(points), sphere, without_ground());
  ASSERT_TRUE(m.error && m.error->bias);
  EXPECT_NEAR(*m.error->bias, kBias, 4 * kSigma / std::sqrt(20'000.0) + sagitta) << "seed " << kSeed;
  EXPECT_NEAR(*m.error->stddev, kSigma, 0.03 * kSigma);
  EXPECT_NEAR(m.error->p95, 0.002 + 1.645 * kSigma, 0.05 * kSigma);
}

TEST(ErrorFigures, SignAShellOutsidePositiveAndInsideNegative) {
  for (double offset : {0.004, -0.004}) {
    const Vector3d grow = Vector3d::Constant(offset);
    PointCloud cloud;
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d low = kBoxLow + 0.01 * Vector3d::Ones(), high = kBoxHigh - 0.01 * Vector3d::Ones();
      low[axis] = (kBoxLow - grow)[axis];
      high[axis] = (kBoxHigh + grow)[axis];
      shapes::append_face(cloud, low, high, axis, 0, 0.004);
      shapes::append_face(cloud, low, high, axis, 1, 0.004);
    }
    const Metrics m = evaluate(cloud, tank_box(), without_ground());
    EXPECT_NEAR(*m.error->bias, offset, 1e-12);
    EXPECT_NEAR(m.error->mean, 0.004, 1e-12);
  }
}

TEST(PointVerdict, PutsEachPointWhereTheRulesSay) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<Vector3d, PointVerdict>> cases{
      {{0, 0, 0.009}, PointVerdict::kObject},      {{0, 0, 0.012}, PointVerdict::kRejected},
      {{0, 0, 0.016}, PointVerdict::kOutlier},     {{0.3, 0, -0.160}, PointVerdict::kGround},
      {{0.3, 0, -0.151}, PointVerdict::kGround},   {{0.3, 0, -0.169}, PointVerdict::kGround},
      {{0.3, 0, -0.149}, PointVerdict::kOutlier},  {{0.0705, 0, -0.156}, PointVerdict::kObject},
      {{0.078, 0, -0.159}, PointVerdict::kGround}, {{nan, 0, 0}, PointVerdict::kRejected},
  };
  MetricThresholds t;
  t.outlier_m = 0.015;
  std::vector<Vector3d> points;
  for (const auto& [p, verdict] : cases) points.push_back(p);
  const Metrics m = evaluate(shapes::cloud_of(points), tank_box(), t);
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(m.verdicts[i], cases[i].second) << "point " << i;
  EXPECT_EQ(m.points, 10u);
  EXPECT_EQ(m.ground_points, 4u);
  EXPECT_EQ(m.object_points, 2u);
  EXPECT_EQ(m.outlier_count, 2u);
  EXPECT_EQ(m.invalid_points, 1u);
  EXPECT_DOUBLE_EQ(*m.outliers, 2.0 / 5.0) << "over points that are finite and not ground";
  EXPECT_DOUBLE_EQ(*m.rejected, 0.8);
}

TEST(Metrics, CountsThePointsItsReaderLeftOutAsRejected) {
  PointCloud cloud = faces({{2, 1}}, 0.005);
  const std::size_t present = cloud.points.size();
  const Metrics without = evaluate(cloud, tank_box(), without_ground());
  cloud.points.push_back({Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())});
  cloud.invalid = present - 1;
  const Metrics m = evaluate(cloud, tank_box(), without_ground());
  EXPECT_EQ(m.points, 2 * present);
  EXPECT_EQ(m.invalid_points, present);
  EXPECT_EQ(m.object_points, present);
  EXPECT_EQ(m.rejected, 0.5);
  EXPECT_EQ(m.outliers, 0.0);
  EXPECT_EQ(m.verdicts.size(), present + 1);
  EXPECT_EQ(m.error->mean, without.error->mean);
}

TEST(PointVerdict, TakesTheGroundPlaneItIsGiven) {
  MetricThresholds t;
  t.ground = Plane{Vector3d::UnitZ(), 0.26};
  const Metrics m = evaluate(shapes::cloud_of({{0.3, 0, -0.26}, {0.3, 0, -0.16}}), tank_box(), t);
  EXPECT_EQ(m.verdicts[0], PointVerdict::kGround);
  EXPECT_EQ(m.verdicts[1], PointVerdict::kOutlier);
  EXPECT_DOUBLE_EQ(m.thresholds.ground->offset, 0.26);
}

TEST(Metrics, OfAnEmptyCloudAreCoverageZeroAndNoError) {
  const Metrics m = evaluate(PointCloud{}, tank_box(), MetricThresholds{});
  EXPECT_FALSE(m.error);
  EXPECT_FALSE(m.outliers);
  EXPECT_FALSE(m.rejected);
  for (const Coverage& c : m.coverage) EXPECT_EQ(c.whole, 0.0);
}

TEST(Metrics, OfOutliersAloneHaveNoErrorFigures) {
  const Metrics m = evaluate(shapes::cloud_of({{0, 0, 0.5}, {0, 0, 0.6}}), tank_box(), MetricThresholds{});
  EXPECT_FALSE(m.error);
  EXPECT_DOUBLE_EQ(*m.outliers, 1.0);
  EXPECT_EQ(m.headline().whole, 0.0);
}

TEST(Metrics, OfOnePointHaveNoSpread) {
  const Metrics m = evaluate(shapes::cloud_of({{0, 0, 0.001}}), tank_box(), MetricThresholds{});
  ASSERT_TRUE(m.error);
  EXPECT_FALSE(m.error->stddev);
  EXPECT_NEAR(m.error->mean, 0.001, 1e-12);
}

TEST(Metrics, AreTheSameBitsForOneThread) {
  constexpr unsigned kSeed = 12;
  std::mt19937_64 random(kSeed);
  std::vector<Vector3d> points;
  for (int i = 0; i < 5000; ++i) points.push_back(0.17 * shapes::random_unit(random));
  const Metrics many = evaluate(shapes::cloud_of(points), tank_box(), MetricThresholds{});
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const Metrics one = evaluate(shapes::cloud_of(points), tank_box(), MetricThresholds{});
  EXPECT_EQ(many.error->mean, one.error->mean);
  EXPECT_EQ(many.headline().whole, one.headline().whole);
  EXPECT_EQ(many.headline().whole_sigma, one.headline().whole_sigma);
}

TEST(Metrics, RefuseThresholdsOutOfOrderAndAForeignCeiling) {
  MetricThresholds t;
  t.outlier_m = 0.005;
  EXPECT_THROW(evaluate(PointCloud{}, tank_box(), t), InputError);
  Ceiling foreign;
  foreign.reachable.resize(3);
  EXPECT_THROW(evaluate(PointCloud{}, tank_box(), MetricThresholds{}, &foreign), InputError);
}

TEST(MetricThresholds, ComeFromTheRigFile) {
  const TemporaryFolder folder;
  const auto load = [&](const char* yaml) { return ConfigNode::load(folder.write("thresholds.yaml", yaml)); };
  const ConfigNode node = load(
      "inlier_m: 0.004\noutlier_m: 0.02\ncoverage_m: [0.001, 0.003]\ncoverage_headline_m: 0.003\n"
      "ground_band_m: 0.015\nmax_incidence_deg: 60\nsurface_samples: 50000\n");
  const MetricThresholds t = settings_from(node, kMetricKeys);
  node.finish();
  EXPECT_EQ(t.inlier_m, 0.004);
  EXPECT_EQ(t.outlier_m, 0.02);
  EXPECT_EQ(t.coverage_m, (std::vector<double>{0.001, 0.003}));
  EXPECT_EQ(t.coverage_headline_m, 0.003);
  EXPECT_EQ(t.ground_band_m, 0.015);
  EXPECT_NEAR(t.max_incidence, std::numbers::pi / 3, 1e-12);
  EXPECT_EQ(t.surface_samples, 50'000u);

  EXPECT_THROW(settings_from(load("inlier_m: 0.02\noutlier_m: 0.01\n"), kMetricKeys), InputError);
  EXPECT_THROW(settings_from(load("coverage_m: [0.001, -3]\n"), kMetricKeys), InputError);
}

}  // namespace
}  // namespace tankrig
