// Three cameras are found together from boards that not all of them saw; a board that does not belong is named.
#include "calibration/stereo/joint_cameras.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/board_calibration/generated_boards.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

constexpr double kNoise_px = 0.15;

struct ThreeCameras {
  std::vector<CameraModel> cameras{true_camera(), true_camera(), true_camera()};
  std::vector<Transform> kMc{Transform::Identity(), make_transform_rpy({-0.1, 0.002, 0.003}, {0.01, -0.03, 0.005}),
                             make_transform_rpy({0.08, -0.03, 0.02}, {-0.03, 0.1, -0.02})};

  ThreeCameras() {
    cameras[1].fx = 541, cameras[1].cx = 318, cameras[1].k1 = -0.26;
    cameras[2].fy = 552, cameras[2].cy = 239, cameras[2].k2 = 0.07;
  }

  /// What each sees of a target in `count` places, and guesses that err by per cents and degrees.
  BoardBundle seen(std::uint64_t seed, const std::string& pattern = "9x6", int count = 20) const {
    std::mt19937_64 random(seed);
    BoardBundle bundle;
    bundle.target = checkerboard(pattern);
    bundle.lens = LensModel::kK1K2P1P2;
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      RationalCamera guess{cameras[k]};
      guess.fx *= 1.02, guess.fy *= 0.99, guess.cx += 5, guess.k1 = guess.k2 = guess.p1 = guess.p2 = 0;
      bundle.cameras.push_back(guess);
      bundle.kMc.push_back(k == 0 ? kMc[k] : make_transform_rpy({0.01, -0.01, 0.01}, {0.02, 0.01, -0.02}) * kMc[k]);
    }
    for (int i = 0; i < count; ++i) {
      const Transform cMt = many_places(cameras[0], bundle.target, 1, random).front();
      BoardView view{"picture " + std::to_string(i + 1), {}};
      for (std::size_t k = 0; k < cameras.size(); ++k) {
        bool whole = true;
        for (const Vector3d& p : bundle.target.points()) {
          const auto pixel = cameras[k].project(kMc[k] * cMt * p);
          whole = whole && pixel && cameras[k].contains(*pixel);
        }
        view.seen.push_back(whole ? corners_of(cameras[k], bundle.target, kMc[k] * cMt, kNoise_px, random)
                                  : FoundBoard());
      }
      bundle.views.push_back(std::move(view));
    }
    return bundle;
  }
};

TEST(JointCameras, AreFoundFromBoardsThatNotAllOfThemSawAndTheirSigmasAreHonest) {
  constexpr std::uint64_t kSeeds = 30;
  const ThreeCameras truth;
  int held = 0, all = 0, unseen = 0;
  const auto count = [&](double error, double sigma) {
    if (sigma > 0) held += std::abs(error) <= 1.96 * sigma ? 1 : 0, ++all;
  };
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const JointCameras found = refine_together(truth.seen(seed));
    EXPECT_NEAR(found.rms, kNoise_px * std::sqrt(2), 0.03);
    EXPECT_TRUE(found.left_out.empty());
    for (const BoardView& view : found.bundle.views)
      for (const FoundBoard& board : view.seen) unseen += board.ids.empty() ? 1 : 0;
    for (std::size_t k = 0; k < truth.cameras.size(); ++k) {
      const CameraParameters is = parameters_of(found.bundle.cameras[k]), was = parameters_of({truth.cameras[k]});
      for (std::size_t i = 0; i < is.size(); ++i) count(is[i] - was[i], found.sigma[k][i]);
      const Transform step = found.bundle.kMc[k] * truth.kMc[k].inverse();
      const Eigen::AngleAxisd turn(step.rotation());
      const Vector3d r = turn.angle() * turn.axis(), t = found.bundle.kMc[k].translation() - truth.kMc[k].translation();
      for (int i = 0; i < 3; ++i) {
        count(r[i], std::sqrt(found.covariance[k](i, i)));
        count(t[i], std::sqrt(found.covariance[k](3 + i, 3 + i)));
      }
    }
  }
  std::printf("seeds 1 to %d, %d boards unseen: ", int(kSeeds), unseen);
  testing_support::expect_honest(held, all);
  EXPECT_GT(unseen, 0);
}

TEST(JointCameras, LeaveOutABoardOfAnotherMomentByName) {
  BoardBundle start = ThreeCameras().seen(31);
  std::vector<BoardView*> whole;  // two boards of three tell which one is wrong
  for (BoardView& view : start.views)
    if (std::none_of(view.seen.begin(), view.seen.end(), [](const FoundBoard& b) { return b.ids.empty(); }))
      whole.push_back(&view);
  ASSERT_GE(whole.size(), 2u);
  std::swap(whole.front()->seen[1], whole.back()->seen[1]);
  const std::string names[] = {whole.front()->name + ", camera 1", whole.back()->name + ", camera 1"};
  const JointCameras found = refine_together(std::move(start));
  ASSERT_EQ(found.left_out.size(), 2u);
  for (const std::string& name : names) EXPECT_THAT(found.left_out, testing::Contains(HasSubstr(name)));
  EXPECT_NEAR(found.rms, kNoise_px * std::sqrt(2), 0.03);
}

TEST(JointCameras, RefuseATargetThatCamerasMayReadDifferently) {
  EXPECT_THAT(message_of<InputError>([] { refine_together(ThreeCameras().seen(32, "8x6")); }),
              HasSubstr("looks the same when turned"));
}

}  // namespace
}  // namespace tankrig
