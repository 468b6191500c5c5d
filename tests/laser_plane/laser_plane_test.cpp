// The sheet found from generated boards and postures, how well, and what is refused.
#include "calibration/laser_plane/laser_plane.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "calibration/laser_plane/stripe_points.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;

const Plane kSheet{Vector3d(0.9995, 0.02, -0.024).normalized(), 0.0979};

struct Noise {
  double point = 0.0002, picture = 0.0002;  ///< of every point, and common to a picture's [m]
  double outliers = 0;                      ///< share of points up to 30 mm off
};

/// Lines across the sheet at `pictures` places, in e.
LaserPlaneProblem generated(std::uint64_t seed, int pictures, const Noise& noise) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vector3d u = kSheet.normal.cross(Vector3d::UnitY()).normalized(), v = kSheet.normal.cross(u);
  LaserPlaneProblem problem;
  for (int k = 0; k < pictures; ++k) {
    problem.groups.push_back({"picture " + std::to_string(k), 1.3 + 0.8 * k / pictures});
    const double range = 0.7 + 0.2 * uniform(random), tilt = 0.3 * uniform(random),
                 off = noise.picture * normal(random);
    for (double along = -0.15; along < 0.15; along += 0.003) {
      const Vector3d on = -kSheet.offset * kSheet.normal + (range + tilt * along) * u + along * v;
      const bool wild = 0.5 * (uniform(random) + 1) < noise.outliers;
      const double away = wild ? 0.03 * uniform(random) : off + noise.point * normal(random);
      problem.points.push_back({on + away * kSheet.normal, noise.point, k});
    }
  }
  problem.targets = {{-kSheet.offset * kSheet.normal + 0.8 * u, kSheet.normal}};
  return problem;
}

double angle_to(const Plane& plane) { return std::asin(plane.normal.cross(kSheet.normal).norm()); }

TEST(LaserPlane, IsFoundExactlyWithoutNoise) {
  const LaserPlaneSolution s = solve(generated(1, 8, {0, 0, 0}));
  EXPECT_LT(angle_to(s.plane), 1e-9);
  EXPECT_NEAR(s.plane.offset, kSheet.offset, 1e-9);
  EXPECT_LT(s.rms, 1e-9);
}

TEST(LaserPlane, LeavesOutPointsOfReflectionsAndOtherSurfaces) {
  const LaserPlaneSolution s = solve(generated(2, 10, {0.0002, 0.0001, 0.3}));
  EXPECT_LT(angle_to(s.plane), 1e-3);
  EXPECT_LT(s.rms, 0.0004);
  EXPECT_NEAR(s.inlier_share, 0.7, 0.06);
}

TEST(LaserPlane, IntervalsHoldTheTruth) {
  constexpr int kTries = 100;
  int held = 0;
  for (int seed = 1; seed <= kTries; ++seed) {
    const LaserPlaneSolution s = solve(generated(static_cast<std::uint64_t>(seed), 20, {}));
    const Vector3d target = generated(1, 3, {}).targets[0].p;
    held += std::abs(s.plane.distance(target)) <= 1.96 * s.sigma_at(target);
  }
  RecordProperty("held", held);
  EXPECT_GE(held, 88);
  EXPECT_LE(held, 100);
}

TEST(LaserPlane, PicturesThatErrAlikeCountAsOneWitnessEach) {
  const double alone = solve(generated(3, 12, {0.0002, 0, 0})).sigma_m;
  const double alike = solve(generated(3, 12, {0.0002, 0.0005, 0})).sigma_m;
  EXPECT_GT(alike, 4 * alone);
}

TEST(LaserPlane, EffectOnTheTargetIsTheDistanceAlongTheRay) {
  LaserPlaneProblem problem = generated(4, 10, {});
  const LaserPlaneSolution square = solve(problem);
  EXPECT_NEAR(square.effect_sigma / square.sigma_at(problem.targets[0].p), 1, 1e-3);
  const Vector3d u = kSheet.normal.cross(Vector3d::UnitY()).normalized();
  problem.targets[0].ray = (kSheet.normal + std::sqrt(3) * u).normalized();  // 30 degrees from the sheet
  EXPECT_NEAR(solve(problem).effect_sigma / square.effect_sigma, 2, 0.01);
}

TEST(LaserPlane, TellsWhenThePlaneMovesWithTheElbow) {
  LaserPlaneProblem problem = generated(5, 20, {});
  const LaserPlaneSolution right = solve(problem);
  ASSERT_TRUE(right.slope);
  EXPECT_LT(std::abs(*right.slope), 4 * right.slope_sigma);
  for (SheetPoint& point : problem.points)
    point.p += 0.003 * std::pow(*problem.groups[static_cast<std::size_t>(point.group)].elbow - 1.7, 2) * kSheet.normal +
               0.002 * (*problem.groups[static_cast<std::size_t>(point.group)].elbow - 1.7) * kSheet.normal;
  const LaserPlaneSolution wrong = solve(problem);
  ASSERT_TRUE(wrong.slope);
  EXPECT_GT(std::abs(*wrong.slope), 4 * wrong.slope_sigma);
}

TEST(LaserPlane, TwoWaysThatAgreeDifferByTheirSigmas) {
  const LaserPlaneSolution a = solve(generated(6, 15, {})), b = solve(generated(7, 15, {}));
  EXPECT_LT(difference(a, b).sigmas, 4);
  LaserPlaneProblem off = generated(7, 15, {});
  for (SheetPoint& point : off.points) point.p += 0.002 * kSheet.normal;
  EXPECT_GT(difference(a, solve(off)).sigmas, 6);
}

TEST(LaserPlane, SaysWhatIsMissing) {
  const auto refusal = [](const LaserPlaneProblem& problem) -> std::string {
    try {
      solve(problem);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal({}), HasSubstr("found no stripe points"));
  EXPECT_THAT(refusal(generated(8, 2, {})), HasSubstr("the stripe in 2 pictures or postures, expected at least 3"));
  LaserPlaneProblem line = generated(9, 10, {});
  for (SheetPoint& point : line.points) point.p = Vector3d(0.1, 0, 0.7) + (point.p.y()) * Vector3d::UnitY();
  EXPECT_THAT(refusal(line), HasSubstr("found all stripe points near one line"));
  EXPECT_THAT(refusal(generated(10, 10, {0.0002, 0.0001, 0.95})), HasSubstr("stripe points on one plane, expected"));
}

/// What a camera sees of the sheet on the plane z = `depth` of the first camera.
StripeLine seen(const CameraModel& camera, const Transform& cMw, const Plane& sheet, const Plane& surface) {
  StripeLine stripe;
  const Vector3d along = sheet.normal.cross(surface.normal).normalized();
  Eigen::Matrix<double, 3, 3> rows;
  rows << sheet.normal.transpose(), surface.normal.transpose(), along.transpose();
  const Vector3d start = rows.inverse() * Vector3d(-sheet.offset, -surface.offset, 0);
  const auto at = [&](double t) { return *camera.project(cMw * (start + t * along)); };
  for (int column = 0; column < camera.width; ++column) {
    double low = -1, high = 1;
    if ((at(low).x() < column) == (at(high).x() < column)) continue;
    const bool rising = at(high).x() > at(low).x();
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      ((at(middle).x() < column) == rising ? low : high) = middle;
    }
    const double row = at(low).y();
    if (row > 0 && row < camera.height - 1) stripe.points.push_back({column, row, 0.05});
  }
  return stripe;
}

const CameraModel kEye{640, 480, 765, 763, 316, 237, -0.1, 0.05, 0, 0, 0};
const Plane kTilted{Vector3d(0.1, 0.5, -0.86).normalized(), 0.8};
const Plane kCut{Vector3d(0.45, 0.8, 0.1).normalized(), -0.1};

TEST(StripePoints, OnABoardLieOnTheSheet) {
  Transform cMt = Transform::Identity();
  cMt.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), kTilted.normal).toRotationMatrix();
  cMt.translation() = -kTilted.offset * kTilted.normal;
  const StripeLine stripe = seen(kEye, Transform::Identity(), kCut, kTilted);
  ASSERT_GT(stripe.points.size(), 100U);
  const auto points = points_on_board(kEye, stripe, cMt, {{-0.6, -0.6}, {0.6, 0.6}});
  ASSERT_GT(points.size(), 50U);
  for (const PlacedStripePoint& point : points) {
    EXPECT_LT(std::abs(kCut.distance(point.p)), 1e-6);
    EXPECT_LT((cMt.inverse() * point.p).cwiseAbs().head<2>().maxCoeff(), 0.6 + 1e-9);
    EXPECT_GT(point.sigma, 1e-5);
    EXPECT_LT(point.sigma, 1e-3);
  }
}

TEST(StripePoints, ByStereoLieOnTheSheetAndTheSurface) {
  const Transform cMr = make_transform_rpy({0.09, 0.001, 0.002}, {0.01, -0.02, 0.005});
  const auto points = points_by_stereo(kEye, kEye, cMr, seen(kEye, Transform::Identity(), kCut, kTilted),
                                       seen(kEye, cMr.inverse(), kCut, kTilted));
  ASSERT_GT(points.size(), 100U);
  for (const PlacedStripePoint& point : points) {
    EXPECT_LT(std::abs(kCut.distance(point.p)), 2e-5);
    EXPECT_LT(std::abs(kTilted.distance(point.p)), 1e-4);
  }
}

TEST(StripePoints, ByStereoAreLeftOutWhereTheStripeLiesAlongTheEpipolarLine) {
  const Plane level{Vector3d(0.002, 1, 0.1).normalized(), -0.02};
  const Transform cMr = make_transform_rpy({0.09, 0, 0}, {0, 0, 0});
  EXPECT_TRUE(points_by_stereo(kEye, kEye, cMr, seen(kEye, Transform::Identity(), level, kTilted),
                               seen(kEye, cMr.inverse(), level, kTilted))
                  .empty());
}

}  // namespace
}  // namespace tankrig
