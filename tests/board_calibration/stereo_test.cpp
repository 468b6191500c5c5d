// Two cameras are found from generated pairs and from published ones; pairs that do not belong together are named.
#include "calibration/stereo/stereo.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/board_calibration/generated_boards.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

CameraModel right_camera() {
  CameraModel camera = true_camera();
  camera.fx = 541, camera.cx = 318, camera.k1 = -0.26;
  return camera;
}
Transform true_rMc() { return make_transform_rpy({-0.1, 0.002, 0.003}, {0.01, -0.03, 0.005}); }

StereoProblem generated_pairs(std::uint64_t seed, const std::string& pattern = "9x6", int count = 10) {
  std::mt19937_64 random(seed);
  StereoProblem problem{{640, 480}, {640, 480}, checkerboard(pattern), {}, LensModel::kK1K2P1P2, false};
  while (static_cast<int>(problem.pairs.size()) < count) {
    const Transform cMt = many_places(true_camera(), problem.target, 1, random).front();
    bool seen = true;
    for (const Vector3d& p : problem.target.points())
      seen = seen && right_camera().contains(right_camera().project(true_rMc() * cMt * p).value());
    if (!seen) continue;
    problem.pairs.push_back({"pair" + std::to_string(problem.pairs.size()),
                             corners_of(true_camera(), problem.target, cMt, 0.15, random),
                             corners_of(right_camera(), problem.target, true_rMc() * cMt, 0.15, random)});
  }
  return problem;
}

TEST(Stereo, ItsIntervalsHoldTheTruth) {
  const int seeds = testing_support::seeds(30);
  int held = 0, all = 0;
  const auto count = [&](const Estimate& e, double truth) {
    held += std::abs(e.value - truth) <= e.half_width ? 1 : 0, ++all;
  };
  const Eigen::AngleAxisd turn(true_rMc().rotation());
  const CameraParameters left = parameters_of({true_camera()}), right = parameters_of({right_camera()});
  for (int seed = 1; seed <= seeds; ++seed) {
    const StereoSolution s = solve(generated_pairs(static_cast<std::uint64_t>(seed)));
    for (int i = 0; i < 3; ++i) {
      count(s.translation[std::size_t(i)], true_rMc().translation()[i]);
      count(s.rotation[std::size_t(i)], (turn.angle() * turn.axis())[i]);
    }
    for (std::size_t i = 0; i < s.left_estimates.size(); ++i)
      count(s.left_estimates[i], left[i]), count(s.right_estimates[i], right[i]);
    EXPECT_LT(s.row_rms, 0.4);
  }
  std::printf("seeds 1 to %d: ", seeds);
  testing_support::expect_honest(held, all);
}

TEST(Stereo, NamesPairsOutOfOrder) {
  StereoProblem problem = generated_pairs(40);
  const FoundBoard first = problem.pairs.front().right;
  for (std::size_t i = 0; i + 1 < problem.pairs.size(); ++i) problem.pairs[i].right = problem.pairs[i + 1].right;
  problem.pairs.back().right = first;
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }), HasSubstr("pictures are out of order"));
}

TEST(Stereo, LeavesOutAPairOfDifferentMoments) {
  StereoProblem problem = generated_pairs(41);
  std::swap(problem.pairs[2].right, problem.pairs[7].right);
  const StereoSolution s = solve(problem);
  ASSERT_EQ(s.left_out.size(), 2u);
  EXPECT_THAT(s.left_out[0], HasSubstr("pair2: the cameras stand otherwise"));
  EXPECT_THAT(s.left_out[1], HasSubstr("pair7: the cameras stand otherwise"));
}

TEST(Stereo, TurnsATargetThatTheRightPictureReadsTheOtherWayRound) {
  StereoProblem problem = generated_pairs(42, "8x6");
  FoundBoard& right = problem.pairs[3].right;
  std::reverse(right.pixels.begin(), right.pixels.end());
  const StereoSolution s = solve(problem);
  EXPECT_THAT(s.turned, ElementsAre("pair3"));
  EXPECT_NEAR(s.rMc.translation().x(), -0.1, 0.001);
}

TEST(Stereo, NamesAMirroredCamera) {
  StereoProblem problem = generated_pairs(43);
  for (BoardPair& pair : problem.pairs) {
    FoundBoard mirrored = pair.right;
    for (std::size_t i = 0; i < mirrored.pixels.size(); ++i) {
      const std::size_t row = i / 9, column = i % 9, from = (5 - row) * 9 + column;
      mirrored.pixels[i] = {639 - pair.right.pixels[from].x(), pair.right.pixels[from].y()};
    }
    pair.right = mirrored;
  }
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }), HasSubstr("one camera's pictures are mirrored"));
}

TEST(Stereo, RefusesPicturesOfTwoSizes) {
  StereoProblem problem = generated_pairs(44);
  problem.right_size = {1280, 960};
  EXPECT_THAT(message_of<InputError>([&] { solve(problem); }),
              HasSubstr("640 x 480 px on the left and of 1280 x 960 px on the right"));
}

}  // namespace
}  // namespace tankrig
