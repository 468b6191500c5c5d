// A camera is found from generated corners, its intervals hold the truth, and bad sets of pictures are refused by name.
#include "calibration/intrinsics/intrinsics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/board_calibration/generated_boards.hpp"
#include "tests/board_calibration/pixel_scatter.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

IntrinsicsProblem generated_pictures(std::uint64_t seed, int pictures = 15, double noise_px = 0.15,
                                     double most_tilt = 0.7) {
  std::mt19937_64 random(seed);
  IntrinsicsProblem problem{640, 480, checkerboard(), {}, LensModel::kK1K2P1P2, false};
  for (const Transform& cMt : many_places(true_camera(), problem.target, pictures, random, most_tilt))
    problem.pictures.push_back({"picture" + std::to_string(problem.pictures.size()),
                                corners_of(true_camera(), problem.target, cMt, noise_px, random)});
  return problem;
}

TEST(Intrinsics, FindsTheCameraOfCornersWithoutNoise) {
  const IntrinsicsSolution s = solve(generated_pictures(1, 8, 1e-6));
  const CameraParameters found = parameters_of({s.camera}), truth = parameters_of({true_camera()});
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], truth[i], 1e-3) << kCameraParameterNames[i];
  EXPECT_LT(s.rms, 1e-5);
}

TEST(Intrinsics, ItsIntervalsHoldTheTruth) {
  const int seeds = testing_support::seeds(40);
  const CameraParameters truth = parameters_of({true_camera()});
  int held = 0, all = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const IntrinsicsSolution s = solve(generated_pictures(std::uint64_t(seed), 10));
    for (std::size_t i = 0; i < s.estimates.size(); ++i, ++all)
      held += std::abs(s.estimates[i].value - truth[i]) <= s.estimates[i].half_width ? 1 : 0;
  }
  std::printf("seeds 1 to %d: ", seeds);
  testing_support::expect_honest(held, all);
}

TEST(Intrinsics, AllowsForNeighboursThatErrAlike) {
  IntrinsicsProblem problem = generated_pictures(3);
  const double alone = solve(problem).noise.allowance;
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0, 0.15);
  // Pairs of neighbours in a row with one error in common.
  for (BoardPicture& picture : problem.pictures)
    for (std::size_t i = 0; i + 1 < picture.board.pixels.size(); i += 2) {
      const Vector2d common(noise(random), noise(random));
      picture.board.pixels[i] += common, picture.board.pixels[i + 1] += common;
    }
  EXPECT_LT(alone, 1.2);
  EXPECT_GT(solve(problem).noise.allowance, 1.08 * alone);
}

TEST(Intrinsics, TakesTheSimplestModelThatFitsPicturesHeldBack) {
  const auto chosen = [](const CameraModel& camera, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    IntrinsicsProblem problem{640, 480, checkerboard(), {}, {}, {}};
    for (const Transform& cMt : many_places(camera, problem.target, 12, random))
      problem.pictures.push_back(
          {"p" + std::to_string(problem.pictures.size()), corners_of(camera, problem.target, cMt, 0.1, random)});
    return solve(problem);
  };
  CameraModel simple = true_camera();
  simple.k2 = simple.p1 = simple.p2 = 0, simple.k1 = -0.15;
  const IntrinsicsSolution k1 = chosen(simple, 5);
  EXPECT_EQ(k1.lens, LensModel::kK1) << k1.decision;
  EXPECT_EQ(k1.bundle.bend, Vector2d::Zero());
  CameraModel tangential = true_camera();
  tangential.p1 = 0.006, tangential.p2 = -0.006;
  const IntrinsicsSolution p = chosen(tangential, 6);
  EXPECT_EQ(p.lens, LensModel::kK1K2P1P2) << p.decision;
  EXPECT_THAT(p.decision, HasSubstr("beyond two standard errors"));
  EXPECT_EQ(p.tried.size(), 6u) << "five lenses, and a bent target";
}

TEST(Intrinsics, FindsABentTarget) {
  std::mt19937_64 random(7);
  IntrinsicsProblem problem{640, 480, checkerboard(), {}, LensModel::kK1K2P1P2, {}};
  BoardBundle bent;
  bent.target = problem.target;
  bent.bend = {0.0004, -0.0009};
  const std::vector<Vector3d> points = bent.points();
  std::normal_distribution<double> noise(0, 0.1);
  for (const Transform& cMt : many_places(true_camera(), problem.target, 12, random)) {
    FoundBoard board = corners_of(true_camera(), problem.target, cMt, 0.1, random);
    for (std::size_t i = 0; i < points.size(); ++i)
      board.pixels[i] = true_camera().project(cMt * points[i]).value() + Vector2d(noise(random), noise(random));
    problem.pictures.push_back({"p" + std::to_string(problem.pictures.size()), board});
  }
  const IntrinsicsSolution s = solve(problem);
  EXPECT_NEAR(s.bundle.bend.x(), 0.0004, 0.0001) << s.decision;
  EXPECT_NEAR(s.bundle.bend.y(), -0.0009, 0.0001);
}

TEST(Intrinsics, TheSameCornersGiveTheSameBits) {
  const IntrinsicsSolution a = solve(generated_pictures(8)), b = solve(generated_pictures(8));
  EXPECT_EQ(parameters_of({a.camera}), parameters_of({b.camera}));
  EXPECT_EQ(a.estimates.front().sigma, b.estimates.front().sigma);
}

TEST(Intrinsics, NamesThePictureThatDoesNotFit) {
  IntrinsicsProblem problem = generated_pictures(9);
  std::mt19937_64 random(10);
  CameraModel other = true_camera();
  other.fx *= 1.3, other.fy *= 1.5, other.k1 = 0.1;
  const Transform cMt = held(problem.target, {0, 0, 0.6}, {0.5, 0.5, 0});
  problem.pictures.push_back({"of another camera", corners_of(other, problem.target, cMt, 0.15, random)});
  problem.pictures[2].board.pixels[7] += Vector2d(4, -3);
  const IntrinsicsSolution s = solve(problem);
  EXPECT_TRUE(s.pictures.back().left_out);
  EXPECT_GT(s.pictures.back().rms, 1);
  EXPECT_EQ(std::count_if(s.pictures.begin(), s.pictures.end(), [](const PictureFit& p) { return p.left_out; }), 1);
  ASSERT_EQ(s.left_out_corners.size(), 1u);
  EXPECT_EQ(s.left_out_corners[0].view, 2u);
  EXPECT_EQ(s.left_out_corners[0].id, 7);
  EXPECT_NEAR(s.camera.fx, true_camera().fx, 5 * s.estimates[0].sigma);
}

TEST(Intrinsics, RefusesPicturesOfTwoCameras) {
  IntrinsicsProblem problem = generated_pictures(11, 8);
  std::mt19937_64 random(12);
  CameraModel other = true_camera();
  other.fx *= 1.3, other.fy *= 1.5, other.k1 = 0.1;
  for (const Transform& cMt : many_places(other, problem.target, 6, random))
    problem.pictures.push_back(
        {"other" + std::to_string(problem.pictures.size()), corners_of(other, problem.target, cMt, 0.15, random)});
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }), HasSubstr("expected pictures of one camera"));
}

TEST(Intrinsics, RefusesASetWithoutRotation) {
  const std::string message = message_of<InputError>([] { solve(generated_pictures(13, 12, 0.15, 0.0)); });
  EXPECT_THAT(message, HasSubstr("the pictures do not tell"));
  EXPECT_THAT(message, HasSubstr("tilt the target by 20 to 45 degrees"));
}

TEST(Intrinsics, RefusesTwoPictures) {
  EXPECT_THAT(message_of<InputError>([] { solve(generated_pictures(14, 2)); }),
              HasSubstr("in 2 pictures, expected 3 at least"));
}

TEST(ProjectionUncertainty, IsWhatGeneratedCamerasScatter) {
  std::mt19937_64 places(15);
  const BoardTarget target = checkerboard();
  const PixelScatter found =
      scatter_of(true_camera(), {60, 400}, target, many_places(true_camera(), target, 10, places), 0.15, 40,
                 [&] { return IntrinsicsProblem{640, 480, target, {}, LensModel::kK1K2P1P2, false}; });
  EXPECT_NEAR(found.told / found.worst, 1, 0.25);
}

}  // namespace
}  // namespace tankrig
