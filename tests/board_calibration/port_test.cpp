// A flat port is found from boards in the water where it matters, and left away where a pinhole fits as well.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calibration/intrinsics/intrinsics.hpp"
#include "calibration/stereo/stereo.hpp"
#include "core/input_error.hpp"
#include "core/ray_meeting.hpp"
#include "tests/board_calibration/generated_boards.hpp"
#include "tests/board_calibration/pixel_scatter.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

CameraModel behind(const FlatPort& port) {
  CameraModel camera = true_camera();
  camera.port = port;
  return camera;
}

FlatPort thick_port() { return {0.045, 0.010, Vector3d(0.03, -0.02, 1).normalized()}; }

IntrinsicsProblem boards_in_water(const CameraModel& camera, std::uint64_t seed, int pictures, double noise_px) {
  std::mt19937_64 random(seed);
  IntrinsicsProblem problem{camera.width, camera.height, checkerboard("7x5"), {}, {}, {}, {}, {}};
  for (const Transform& cMt : near_and_far(camera, problem.target, pictures, random))
    problem.pictures.push_back({"picture" + std::to_string(problem.pictures.size()),
                                corners_of(camera, problem.target, cMt, noise_px, random)});
  problem.port = FlatPort{0.02, camera.port->thickness};
  return problem;
}

/// The lens as boards in air told it.
IntrinsicsProblem lens_known(IntrinsicsProblem problem) {
  problem.in_air = true_camera();
  return problem;
}

TEST(PortCalibration, FindsThePortOfCornersWithoutNoise) {
  const CameraModel truth = behind(thick_port());
  for (const bool known : {true, false}) {
    IntrinsicsProblem problem = boards_in_water(truth, 1, 10, 1e-6);
    problem.lens = LensModel::kK1K2P1P2;
    const IntrinsicsSolution s = solve(known ? lens_known(problem) : problem);
    ASSERT_TRUE(s.camera.port) << s.decision;
    EXPECT_NEAR(s.camera.port->distance, 0.045, 1e-4);
    EXPECT_LT((s.camera.port->normal - truth.port->normal).norm(), 1e-4);
    EXPECT_NEAR(s.camera.fx, truth.fx, 0.2);
    EXPECT_EQ(s.camera.port->thickness, 0.010) << "given";
    EXPECT_LT(s.rms, 1e-5);
  }
}

TEST(PortCalibration, ItsIntervalsHoldTheTruth) {
  const int seeds = testing_support::seeds(30);
  const CameraModel truth = behind(thick_port());
  const PortParameters port = parameters_of(*truth.port);
  int held = 0, all = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    IntrinsicsProblem problem = lens_known(boards_in_water(truth, std::uint64_t(seed), 10, 0.03));
    problem.lens = LensModel::kK1K2P1P2;  // of the pinhole beside it
    const IntrinsicsSolution s = solve(problem);
    ASSERT_TRUE(s.camera.port) << s.decision;
    ASSERT_EQ(s.estimates.size(), port.size()) << "the lens is held";
    for (std::size_t i = 0; i < port.size(); ++i, ++all)
      held += std::abs(s.estimates[i].value - port[i]) <= s.estimates[i].half_width ? 1 : 0;
  }
  std::printf("seeds 1 to %d: ", seeds);
  testing_support::expect_honest(held, all);
}

TEST(PortCalibration, LensAndPortTogetherHoldTheTruthToo) {
  constexpr int kSeeds = 5;
  CameraModel truth = behind(thick_port());
  truth.p1 = truth.p2 = 0;
  const PortParameters port = parameters_of(*truth.port);
  const CameraParameters lens = parameters_of({truth});
  int held = 0, all = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    IntrinsicsProblem problem = boards_in_water(truth, std::uint64_t(seed), 12, 0.03);
    problem.lens = LensModel::kK1K2;
    const IntrinsicsSolution s = solve(problem);
    if (!s.camera.port) continue;
    for (const Estimate& e : s.estimates) {
      double value = 0;
      for (std::size_t i = 0; i < lens.size(); ++i)
        if (e.name == kCameraParameterNames[i]) value = lens[i];
      for (std::size_t i = 0; i < port.size(); ++i)
        if (e.name == kPortParameterNames[i]) value = port[i];
      ++all, held += std::abs(e.value - value) <= e.half_width ? 1 : 0;
      EXPECT_GT(e.effect, 0) << e.name;
    }
  }
  std::printf("seeds 1 to %d: %d of %d 95 %% intervals hold the truth (%.1f %%)\n", kSeeds, held, all,
              100.0 * held / all);
  EXPECT_GE(all, 9 * kSeeds * 3 / 4);
  EXPECT_GE(held, 0.90 * all);
}

TEST(PortCalibration, APinholeDoesNotFitPicturesHeldBackBehindAFarPort) {
  for (int seed = 1; seed <= 3; ++seed) {
    const IntrinsicsSolution s =
        solve(lens_known(boards_in_water(behind(thick_port()), std::uint64_t(seed), 15, 0.02)));
    ASSERT_TRUE(s.camera.port) << s.decision;
    double pinhole = 1e9;
    for (const TriedModel& m : s.tried)
      if (!m.port && m.lens != LensModel::kRational) pinhole = std::min(pinhole, m.held_back_rms);
    std::printf("seed %d: held back %.4f px behind a port, %.4f px by the best pinhole\n", seed,
                s.tried.back().held_back_rms, pinhole);
    EXPECT_TRUE(s.tried.back().port);
    EXPECT_GT(pinhole, 1.3 * s.tried.back().held_back_rms);
    EXPECT_THAT(s.decision, HasSubstr("window flat port: "));
    EXPECT_THAT(s.decision, HasSubstr("the less simple pinhole: "));
  }
}

TEST(PortCalibration, KeepsThePinholeWhereThePortIsThinAndNear) {
  for (int seed = 1; seed <= 2; ++seed) {
    const IntrinsicsSolution s = solve(boards_in_water(behind({0.0005, 0.001}), std::uint64_t(seed), 12, 0.2));
    EXPECT_FALSE(s.camera.port) << "seed " << seed << ": " << s.decision;
    EXPECT_THAT(s.decision, HasSubstr("window pinhole: "));
  }
}

TEST(PortCalibration, NamesThePictureThatDoesNotFitAndKeepsTheNearOnes) {
  const CameraModel camera = behind(thick_port());
  IntrinsicsProblem problem = lens_known(boards_in_water(camera, 5, 12, 0.1));
  std::mt19937_64 random(6);
  FoundBoard shaken = corners_of(camera, problem.target, held(problem.target, {0, 0, 0.6}, {0.5, 0.5, 0}), 0.1, random);
  for (std::size_t i = 0; i < shaken.pixels.size(); ++i) shaken.pixels[i].x() += i % 2 == 0 ? 2 : -2;
  problem.pictures.push_back({"shaken", shaken});
  const IntrinsicsSolution s = solve(problem);
  ASSERT_TRUE(s.camera.port) << s.decision;
  for (const PictureFit& picture : s.pictures) EXPECT_EQ(picture.left_out, picture.name == "shaken") << picture.name;
}

/// A wall's points as they are and as somebody reconstructs them: what is left once one is laid over the other [mm].
double off_mm(const std::vector<Vector3d>& truth, const std::vector<Vector3d>& found) {
  const auto n = static_cast<Eigen::Index>(truth.size());
  Eigen::Matrix3Xd a(3, n), b(3, n);
  for (Eigen::Index i = 0; i < n; ++i)
    a.col(i) = truth[static_cast<std::size_t>(i)], b.col(i) = found[static_cast<std::size_t>(i)];
  const Eigen::Matrix4d fit = Eigen::umeyama(b, a, false);
  return 1e3 * std::sqrt(((fit.topLeftCorner<3, 3>() * b).colwise() + fit.topRightCorner<3, 1>() - a)
                             .colwise()
                             .squaredNorm()
                             .mean());
}

/// Where the line of sight meets the plane.
Vector3d met(const ViewingRay& ray, const Plane& plane) {
  return ray.at(-plane.distance(ray.origin) / plane.normal.dot(ray.direction));
}

Plane fitted(const std::vector<Vector3d>& points) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) scatter += (p - middle) * (p - middle).transpose();
  const Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  return {normal, -normal.dot(middle)};
}

/// A stripe on boards tells the sheet, then the sheet the places of a stripe on walls: by the port, and by a pinhole that was
/// calibrated from the same pictures.
TEST(PortCalibration, LaserPointsAreFarNearerToTheTruthThanAPinholes) {
  const CameraModel truth = behind(thick_port());
  const Plane sheet{Vector3d(0.05, 0.8, -0.45).normalized(), 0.2};
  IntrinsicsProblem problem = lens_known(boards_in_water(truth, 21, 15, 0.05));
  const IntrinsicsSolution port = solve(problem);
  problem.port.reset();
  const IntrinsicsSolution pinhole = solve(problem);
  ASSERT_TRUE(port.camera.port) << port.decision;
  double errors[2];
  for (const bool by_port : {false, true}) {
    const IntrinsicsSolution& s = by_port ? port : pinhole;
    std::vector<Vector3d> on_sheet, real, found;
    for (std::size_t v = 0; v < s.bundle.views.size(); ++v) {
      const auto pose = board_pose({truth}, problem.target.points(), s.bundle.views[v].seen[0]);
      ASSERT_TRUE(pose);
      const Plane board = pose->cMt * Plane{}, believed = s.bundle.cMt[v] * Plane{};
      for (double u = 60; u < 600; u += 30)  // the sheet crosses the board somewhere in each column
        for (double row = 0; row < 480; row += 0.25)
          if (const Vector3d p = met(truth.sight(u, row), board); std::abs(sheet.distance(p)) < 1e-4) {
            on_sheet.push_back(met(s.camera.sight(u, row), believed));
            break;
          }
    }
    ASSERT_GT(on_sheet.size(), 50u);
    const Plane its_sheet = fitted(on_sheet);
    for (const double z : {0.4, 0.6, 0.9, 1.2})
      for (double x = -0.12; x <= 0.121; x += 0.01) {
        const Vector3d p(x, -(sheet.normal.x() * x + sheet.normal.z() * z + sheet.offset) / sheet.normal.y(), z);
        const auto pixel = truth.project(p);
        if (!pixel || !truth.contains(*pixel)) continue;
        real.push_back(p), found.push_back(met(s.camera.sight(pixel->x(), pixel->y()), its_sheet));
      }
    ASSERT_GT(real.size(), 60u);
    errors[by_port] = off_mm(real, found);
  }
  std::printf("laser points off the truth, laid over it: %.3f mm by the port, %.3f mm by a pinhole\n", errors[1],
              errors[0]);
  EXPECT_LT(errors[1], 0.15);
  EXPECT_GT(errors[0], 3 * errors[1]);
}

TEST(PortCalibration, StereoPointsAreFarNearerToTheTruthThanAPinholes) {
  const CameraModel left = behind(thick_port());
  CameraModel right = left;
  right.fx = 541, right.cx = 318, right.k1 = -0.26;
  right.port->distance = 0.04, right.port->normal = Vector3d(-0.02, 0.01, 1).normalized();
  const Transform rMc = make_transform_rpy({-0.1, 0.002, 0.003}, {0.01, -0.03, 0.005});
  constexpr unsigned kPairsSeed = 22;
  std::printf("seed %u\n", kPairsSeed);
  std::mt19937_64 random(kPairsSeed);
  StereoProblem problem{{640, 480}, {640, 480}, checkerboard("7x5"), {}, {}, false, {}, {}, {}};
  while (problem.pairs.size() < 12) {
    const Transform cMt = near_and_far(left, problem.target, 1, random).front();
    bool seen = true;
    for (const Vector3d& p : problem.target.points()) {
      const auto pixel = right.project(rMc * cMt * p);
      seen = seen && pixel && right.contains(*pixel);
    }
    if (seen)
      problem.pairs.push_back({"pair" + std::to_string(problem.pairs.size()),
                               corners_of(left, problem.target, cMt, 0.03, random),
                               corners_of(right, problem.target, rMc * cMt, 0.03, random)});
  }
  double errors[2];
  for (const bool by_port : {false, true}) {
    if (by_port) {
      problem.port = FlatPort{0.02, 0.010};
      problem.left_in_air = left, problem.right_in_air = right;
      problem.left_in_air->port.reset(), problem.right_in_air->port.reset();
    }
    const StereoSolution s = solve(problem);
    const CameraModel &l = s.bundle.cameras[0], &r = s.bundle.cameras[1];
    EXPECT_EQ(l.port.has_value(), by_port) << s.left.decision;
    if (by_port) {
      EXPECT_LT((s.rMc.translation() - rMc.translation()).norm(), 0.001);
      ASSERT_EQ(s.right_estimates.size(), 3u);
      EXPECT_NEAR(s.right_estimates[0].value, 0.04, 2 * s.right_estimates[0].half_width);
    }
    std::vector<Vector3d> real, found;
    for (const double z : {0.4, 0.6, 0.9, 1.2})
      for (double y = -0.1; y < 0.11; y += 0.02)
        for (double x = -0.1; x < 0.16; x += 0.02) {
          const Vector3d p(x, y, z);
          const auto a = left.project(p), b = right.project(rMc * p);
          if (!a || !b || !left.contains(*a) || !right.contains(*b)) continue;
          real.push_back(p);
          found.push_back(meeting(l.sight(a->x(), a->y()), s.rMc.inverse() * r.sight(b->x(), b->y())));
        }
    ASSERT_GT(real.size(), 100u);
    errors[by_port] = off_mm(real, found);
  }
  std::printf("stereo points off the truth, laid over it: %.3f mm by the ports, %.3f mm by pinholes\n", errors[1],
              errors[0]);
  EXPECT_LT(errors[1], 0.2);
  EXPECT_GT(errors[0], 3 * errors[1]);
}

TEST(PortCalibration, KnowsHowWellItPutsAPointIntoThePicture) {
  std::mt19937_64 places(7);
  const CameraModel truth = behind(thick_port());
  const BoardTarget target = checkerboard("7x5");
  const PixelScatter found =
      scatter_of(truth, {500, 400}, target, near_and_far(truth, target, 10, places), 0.03, 16, [&] {
        IntrinsicsProblem problem = lens_known({640, 480, target, {}, LensModel::kK1K2P1P2, {}, {}, {}});
        problem.port = FlatPort{0.02, truth.port->thickness};
        return problem;
      });
  EXPECT_NEAR(found.told / found.worst, 1, 0.3);
}

TEST(PortCalibration, RefusesTooFewPictures) {
  const IntrinsicsProblem problem = lens_known(boards_in_water(behind(thick_port()), 8, 5, 0.1));
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }),
              HasSubstr("found the target in 5 pictures, expected 6 at least to tell a port from a pinhole"));
}

}  // namespace
}  // namespace tankrig
